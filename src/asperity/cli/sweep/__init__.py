"""``asperity sweep``: any number of points from a plan into a Zarr store."""
