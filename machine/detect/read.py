"""Read: a text that a firmware tells itself by, known by what stands in it."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from machine.detect import grblhal, klipper, linuxcnc, marlin, reprapfirmware
from machine.detect.found import ConfigText, Found
from profiles.errors import ProfileError


class Reader(NamedTuple):
    """recognise: whether a text is of this firmware; read: what it tells, raises ProfileError; text: what is read, for people."""

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
    """What a text tells of its machine. Raises ProfileError for a text of no firmware known here, or one that is not whole."""
    for reader in READERS.values():
        if reader.recognise(config.text):
            return reader.read(config)
    known = [reader.text for reader in READERS.values()]
    raise ProfileError(f"{config.name}: it is no firmware's configuration: {', '.join(known[:-1])} or {known[-1]} is expected")
