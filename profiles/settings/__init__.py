"""Settings of a process: a file for each matter, all of them the fields of one Process.

A key is declared by `simple`, `advanced` or `rare` of profiles.frozen: first what people read and what is allowed, then its
default and meaning.
"""
