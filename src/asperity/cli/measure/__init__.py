"""``asperity measure``: recordings read by options, measured, printed as text, JSON or tables."""
