"""Estimate: time and filament of parts from a sample of their layers, and duration of moves."""
