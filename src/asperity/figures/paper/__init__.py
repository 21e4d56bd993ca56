"""The figures of Bureau, Baumberger and Caroli (2000) as the models have them, and one of our own."""
