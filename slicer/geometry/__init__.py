"""Plane geometry: polygons, polylines and segments, lines clipped to polygons, edges near a place, triangulations."""
