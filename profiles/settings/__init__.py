"""Settings of a process: a file for each matter, all of them the fields of one Process."""
