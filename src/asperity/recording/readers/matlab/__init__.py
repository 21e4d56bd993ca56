"""MATLAB files up to version 7.2; those of version 7.3 are HDF5."""
