"""Computations of the server: short ones in threads, long ones in worker processes."""
