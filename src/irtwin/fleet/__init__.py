"""Many data sets: each taken through `run` or `diagnose` by itself."""
