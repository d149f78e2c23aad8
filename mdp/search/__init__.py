"""Search: from a mesh to its ordered parts, by a beam of cuts or by a person's planes.

`search.decompose` searches, `search.cut_by_plan` cuts as a plan says, `orient.orient_and_decompose` chooses orientation and
parts together, `by_hand.try_planes` makes a person's cuts, `trial.Trials` tries planes moved by hand; `problem.Problem` is what a
search holds fixed. `plan_file.PlanFile` is a decomposition that a person can read, change and use again, `plan_reading.read_plan`
and `plan_writing.plan_text` its file.
"""
