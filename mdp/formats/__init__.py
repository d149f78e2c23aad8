"""Formats: a reader for every kind of mesh file, all in `readers.READERS`."""
