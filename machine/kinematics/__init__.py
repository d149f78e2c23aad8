"""Kinematics: where a point of the workpiece is in the machine, and back; how near the head comes to what turns.

`table.machine_points` and `table.workpiece_points` for one pose, `table.workpiece_path` for a pose a row,
`table.followed_places` for firmwares that follow the table, `collision` for the gap between bodies. A pose's rotation is
`mdp.pose`'s, for the search asks for it too.
"""
