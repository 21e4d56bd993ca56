"""``asperity fit``: data read, a law fitted to them, its posterior sampled."""
