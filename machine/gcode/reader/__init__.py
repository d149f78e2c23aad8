"""Reader: interprets a G-code text like a firmware, command by command.

`parse.parse_gcode` returns a `parsed.ParsedProgram` with one row per move; `machine.gcode.lines.GcodeFile` is a text file.
"""
