"""Planning: sliced parts become strokes, travels and turns of the table, each inside the limits, each with its time.

`plan.plan` makes the `moves.MachineProgram`; `timing.move_times` is its clock and the dry run's, `limits` and `fit` say what
the axes reach, `reorient.route` how the tip gets out of the way of a turn.
"""
