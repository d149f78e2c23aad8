"""Batch: many calls on many cores, here or on the workers of a dask scheduler, and the table of their results."""
