"""Planning: sliced parts become strokes, travels and turns of the table, each inside the limits, each with its time.

`plan.plan` makes the `moves.MachineProgram`; `limits` and `fit` say what the axes reach, `stand.route` how
the tip gets out of the way of a turn. Planning and dry run time their moves by `slicer.estimate.timing.move_times`.
"""
