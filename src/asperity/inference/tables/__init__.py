"""Tables of lock-in readings, the predictions of laws, and residuals."""
