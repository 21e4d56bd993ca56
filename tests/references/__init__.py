"""Independent references that tests of several rooms share."""
