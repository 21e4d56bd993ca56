"""The virtual tribometer: from the motion of a slider to what a laboratory would record."""
