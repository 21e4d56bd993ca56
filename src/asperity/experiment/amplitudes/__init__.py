"""The amplitude protocol: modulate, read, switch off, measure F(0) again, next amplitude."""
