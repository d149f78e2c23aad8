"""Topology: edges of a surface, adjacent faces, and connected components.

`edges.edges_of` for arrays of any faces, `edges.opposites` and `edges.link` for oriented ones, `components` for arrays and inside
kernels, `cross_section` for the outlines of a surface at given heights.
"""
