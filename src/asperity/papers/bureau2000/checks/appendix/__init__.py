"""Claims of the appendix: the contacts in the normal direction, and the air layer beside them."""
