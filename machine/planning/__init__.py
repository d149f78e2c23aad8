"""Planning: turns sliced parts into strokes, travels and turns of the table, within the limits and with their times.

`plan.plan` makes the `moves.MachineProgram`; `limits` and `fit` check the reach of the axes, `stand.route` moves the tip out of
the way of a turn. Planning and dry run compute times with `slicer.estimate.timing.move_times`.
"""
