"""Kinematics: conversion between workpiece and machine coordinates, and distances between the head and what turns.

`table.machine_points` and `table.workpiece_points` for one pose, `table.workpiece_path` for a pose per row,
`table.followed_places` for firmwares that follow the table, `collision` for the gap between bodies. A pose's rotation is in
`mdp.pose`, because the search needs it too.
"""
