"""The store of a sweep: a Zarr hierarchy that any reader opens, written chunk by chunk."""
