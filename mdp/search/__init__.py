"""Search: from a mesh to its ordered parts, by a beam of cuts or by user-defined planes.

`search.decompose` searches, `search.cut_by_plan` cuts by a plan, `orient.orient_and_decompose` chooses orientation and parts
together, `by_hand.try_planes` makes a user's cuts, `trial.Trials` tests planes moved by hand; `problem.Problem` holds what is
constant during a search. `plan_file.PlanFile` is a decomposition that a user can read, edit and use again;
`plan_reading.read_plan` and `plan_writing.plan_text` read and write its file.
"""
