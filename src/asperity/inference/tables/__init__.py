"""Tables of lock-in readings, what laws predict for them, and how far the data are from that."""
