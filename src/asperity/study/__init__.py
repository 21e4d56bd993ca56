"""Studies: tables of operating points, and the paper's results from the package's own models."""
