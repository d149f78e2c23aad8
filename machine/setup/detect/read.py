"""Read: recognise the firmware that a text comes from, and read what it says."""

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

from machine.setup.detect import grblhal, klipper, linuxcnc, marlin, reprapfirmware
from machine.setup.detect.found import ACCELERATION, PRINTING, SPEED, ConfigText, Found, Reading, rounded
from profiles.errors import ProfileError

SOURCE = re.compile(r"^\s*(?://\s*)?#define\s+[A-Z]|^\[(?:platformio|env:|config:)", re.MULTILINE)


class Reader(NamedTuple):
    """recognise: whether a text is of this firmware; read: what it says, raises ProfileError; text: its kind, for people."""

    recognise: Callable[[str], bool]
    read: Callable[[ConfigText], Found]
    text: str


READERS: Mapping[str, Reader] = {
    "LinuxCNC": Reader(linuxcnc.recognise, linuxcnc.read, "LinuxCNC's .ini"),
    "Klipper": Reader(klipper.recognise, klipper.read, "Klipper's printer.cfg"),
    "RepRapFirmware": Reader(reprapfirmware.recognise, reprapfirmware.read, "RepRapFirmware's config.g"),
    "grblHAL": Reader(grblhal.recognise, grblhal.read, "a dump of grblHAL's $$"),
    "Marlin": Reader(marlin.recognise, marlin.read, "a log of Marlin's M503"),
}


def read(config: ConfigText) -> Found:
    """What a text says of its machine, numbers as a profile has them.

    Raises ProfileError for a text of no firmware known here, and for one without speed or acceleration of X, Y or Z, which every
    firmware has: half a file.
    """
    found = _reader(config).read(config)
    lacking = [
        f"{word} of {letter}" for letter in PRINTING for word in (SPEED, ACCELERATION) if word not in found.axes.get(letter, {})
    ]
    if lacking:
        raise ProfileError(f"{config.name}: it is {found.firmware}'s, but tells no {', no '.join(lacking[:2])}: is it whole?")
    axes = {letter: _rounded(readings) for letter, readings in found.axes.items()}
    return replace(found, axes=axes, settings=_rounded(found.settings))


def _reader(config: ConfigText) -> Reader:
    for reader in READERS.values():
        if reader.recognise(config.text):
            return reader
    if SOURCE.search(config.text):
        raise ProfileError(
            f"{config.name}: it is source that a firmware is built from (Configuration.h, platformio.ini, config.ini), not what "
            "the printer has stored: the answers to M115, M503 and M211 are expected, saved as a log, or asked for by --port"
        )
    known = [reader.text for reader in READERS.values()]
    raise ProfileError(f"{config.name}: it is no firmware's configuration: {', '.join(known[:-1])} or {known[-1]} is expected")


def _rounded(readings: Mapping[str, Reading]) -> dict[str, Reading]:
    return {key: Reading(rounded(value), source) for key, (value, source) in readings.items()}
