"""Stick-slip as data of a fit: the averaged cycle."""
