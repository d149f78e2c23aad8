"""Settings of a process: a file for each subject, all of them fields of Process.

A key is declared by `simple`, `advanced` or `rare` of profiles.frozen: first its title and allowed values, then its default and
meaning.
"""
