"""Detection: what a firmware tells of its machine, and the profile that follows from it.

One file a firmware reads the texts that it tells itself by, into values with their sources (found); propose() makes of them what
a profile of the nearest shipped machine says otherwise. All of it without I/O: who calls has the text.
"""
