"""Link: the host's side of a serial line: streaming, pausing, the journal, resuming.

`stream.print_lines` streams a program through a port and reports its `print_state.PrintStatus`; `pending_commands.Control` takes
the user's requests. `journal` records the progress and `resume.plan_resume` continues from it. `port` opens serial ports;
`medium.Medium` is what real and simulated ports and clocks have in common.
"""
