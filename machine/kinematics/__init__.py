"""Kinematics: where points of the workpiece are on a table that tilts and turns, and what of the head could meet what."""
