"""Plans: a decomposition as a file that a person can read, change and use again.

`plan_file.PlanFile` is what it holds, `reading.read_plan` and `writing.plan_text` its file.
"""
