"""Estimate: what parts cost in time and filament, known from some of their layers, and how long moves take."""
