"""Levels: what the events of a program have set before each of its rows: temperatures, the fan."""

from collections.abc import Sequence

import numpy as np

from machine.firmware import dialect_of
from machine.reader.parsed import Event, ParsedProgram
from mdp.mesh import Floats
from profiles.machine import Machine


def temperatures(program: ParsedProgram, *codes: str) -> Floats:
    """(n,) the target that the last of the events of these codes before each row has set, deg C; 0 before the first."""
    return _levels(program, [(event, event.value) for event in program.events if event.code in codes])


def fan_shares(program: ParsedProgram, machine: Machine) -> Floats:
    """(n,) 0..1; M106 without a value means full, and full is 255 also where the firmware knows 0 to 1 as well."""
    dialect = dialect_of(machine)
    shares = []
    for event in program.events:
        if event.code == "M106":
            value = event.value if dialect.value_word in event.letters else dialect.fan_full
            shares.append((event, min(1.0, value / (dialect.fan_full if value <= dialect.fan_full else 255))))
        elif event.code == "M107":
            shares.append((event, 0.0))
    return _levels(program, shares)


def _levels(program: ParsedProgram, set_by: Sequence[tuple[Event, float]]) -> Floats:
    rows, values = [event.row for event, _ in set_by], [0.0, *(value for _, value in set_by)]
    return np.repeat(values, np.diff([0, *rows, len(program.line)]))
