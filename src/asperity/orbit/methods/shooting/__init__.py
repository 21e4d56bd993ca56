"""Shooting over one period, for equations that are not stiff but oscillate."""
