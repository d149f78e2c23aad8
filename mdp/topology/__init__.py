"""Topology: edges of a surface, the faces across them, and what hangs together."""
