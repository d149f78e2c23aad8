"""Estimate: what parts cost in time and filament, known from some of their layers, and how long moves take.

Public: `estimate.estimate`; `timing.move_times`, which is the clock of the whole program.
"""
