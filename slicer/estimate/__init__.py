"""Estimate: what parts cost in time and filament, known from some of their layers. Public: estimate.estimate."""
