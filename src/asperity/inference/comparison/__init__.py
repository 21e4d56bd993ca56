"""Which laws the data exclude: evidence, cross-validation and the verdict."""
