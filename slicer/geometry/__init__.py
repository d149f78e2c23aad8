"""Plane geometry: polygons, lines clipped to them, cells, distances, triangulations; nothing of printing."""
