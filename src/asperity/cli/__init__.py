"""The command line: a thin shell without physics and without defaults.

Results go to stdout, messages to stderr. Exit code 0: done; 1: done, but some points have a reason
in place of numbers; 2: bad input; 130: interrupted.
"""
