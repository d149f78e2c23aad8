"""Reader: a G-code text as a firmware would understand it, command by command.

`parse.parse_gcode` gives a `parsed.ParsedProgram`, one row a move; `machine.gcode.lines.GcodeFile` is a file of text.
"""
