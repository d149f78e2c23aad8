"""Plane geometry: cross sections of meshes, polygons, lines clipped to them, cells, distances, triangulations."""
