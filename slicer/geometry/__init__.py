"""Plane geometry: polygons, polylines and segments, clipping of lines to polygons, nearest edges, triangulations."""
