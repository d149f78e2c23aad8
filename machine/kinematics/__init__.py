"""Machine shapes: one file per shape, the same few functions in each."""
