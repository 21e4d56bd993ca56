"""Figures: numbers to CSV, then to a picture. Nothing is solved here."""
