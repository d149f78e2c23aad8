"""Slow commands: how long the `ok` of each may take, and which must not be stopped. Such a command travels alone."""

from machine.gcode.commands import command_in


def is_waited_for(command: str) -> bool:
    """Whether a command must be waited for when a print is ended: homing and probing must not be stopped, a dwell cannot be."""
    row = command_in(command)
    return row.homes or row.probes or row.waits == "time"


def slow_timeout_s(command: str) -> float:
    """How long the answer to a slow command may take, 0 for a quick one."""
    if command[0] == "G" and command[1:2] in ("0", "1"):  # most lines of a program; none of these is slow
        return 0.0
    return command_in(command).answer_s
