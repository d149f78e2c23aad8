"""Topology: edges of a surface, the faces across them, and what hangs together.

`edges.edges_of` for arrays of any faces, `linked_faces.opposites` and `linked_faces.link` for oriented ones, `components` for
arrays and `union_find` inside kernels, `cross_section` for the outlines of a surface at heights.
"""
