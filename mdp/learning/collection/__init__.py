"""Collection: records of wide searches over many models, made as tasks of a dask cluster and listed in an index."""
