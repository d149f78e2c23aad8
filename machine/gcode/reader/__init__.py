"""Reader: what a firmware would understand of a G-code text, command by command.

`parse.parse_gcode` gives a `parsed.ParsedProgram`, one row a move; `machine.gcode.lines.GcodeFile` is a file of text.
"""
