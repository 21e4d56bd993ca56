"""Linear algebra of many small systems at once, one an operating point."""
