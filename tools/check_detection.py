"""Compare what is read from published configurations with the shipped machines that were written by hand from them.

    python tools/check_detection.py config.g=open5x_voron0 printer.cfg=fractal5pro ...

For each FILE=MACHINE: whether that machine is found as the nearest, or has to be named because the file does not say which axis
tilts; how many values are read, and each that differs from the machine's.
"""

import sys
from functools import reduce
from pathlib import Path

from machine.cli.commands.profiles.detection import read_file
from machine.setup.detect.proposal import propose, read
from profiles.errors import ProfileError
from profiles.machine import Machine
from profiles.profile import load


def differing(file: Path, name: str) -> str:
    """The line of one file."""
    try:
        found = read(read_file(file))
    except ProfileError as error:
        return f"refused: {error}"
    try:
        proposal = propose(found)
        nearest = "is nearest" if proposal.base == name else f"nearest is {proposal.base}"
    except ProfileError:
        proposal, nearest = propose(found, name), "has to be named"
    machine = load(name).machine
    others = [
        f"{key} {_value(machine, key)} {reading.value}"
        for key, reading in proposal.values.items()
        if _value(machine, key) != reading.value
    ]
    return f"{name} {nearest}, {len(proposal.values)} read, {len(others)} differ: {'; '.join(others) or 'none'}"


def _value(machine: Machine, key: str) -> object:
    value = reduce(getattr, key.split(".")[1:], machine)
    return list(value) if isinstance(value, tuple) else value


if __name__ == "__main__":
    for pair in sys.argv[1:]:
        path, _, shipped = pair.rpartition("=")
        sys.stdout.write(f"{Path(path).name}: {differing(Path(path), shipped)}\n")
