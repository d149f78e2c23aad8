"""The protocol without I/O: bytes in, events out; commands in, bytes out.

`connection.Connection` is the whole of it; `events.read_event` reads one line of the printer, `framing.frame` numbers one for it.
"""
