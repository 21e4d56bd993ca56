"""The command line: a thin shell without physics and without defaults.

Data go to stdout, talk to stderr. Exit code 0: done; 1: done, but some points failed and say why;
2: bad input; 130: interrupted.
"""
