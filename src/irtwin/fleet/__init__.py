"""Many data sets: each taken through `run` or `diagnose` by itself, on one machine or on a Dask cluster."""
