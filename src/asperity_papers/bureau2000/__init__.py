"""Bureau, Baumberger and Caroli, Phys. Rev. E 62, 6810 (2000)."""
