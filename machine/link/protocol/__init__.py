"""The serial protocol without I/O: bytes in, events out; commands in, bytes out.

`connection.Connection` is the interface; `events.read_event` parses a line of the printer, `framing.frame` numbers a command.
"""
