"""C. Marone, Annu. Rev. Earth Planet. Sci. 26, 643 (1998): rate and state friction of faults."""
