"""Sweep: all offsets of one direction evaluated in one pass over the faces."""
