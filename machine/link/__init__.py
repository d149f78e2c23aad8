"""Link: the host's side of the line: streaming, pausing, the journal, resuming.

`stream.print_lines` streams a program through a port and tells its `print_state.PrintStatus`, `pending_commands.Control` takes
what a person asks of it; `journal` keeps how far it got, `resume.plan_resume` finds the way on from there. `port` opens serial
ports, `medium.Medium` is what a port, a simulated one and a clock have in common.
"""
