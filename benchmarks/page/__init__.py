"""The browser page: many users at once, time from slider to picture, and an hour of sliding."""
