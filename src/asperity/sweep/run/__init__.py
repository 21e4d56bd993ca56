"""Running sweeps: tasks in rolling windows, on the processes of one machine or on Dask.

Nothing is imported here: workers set the number of threads before JAX is loaded.
"""
