"""A paper about a block on a spring, to prove that a second paper is one folder."""
