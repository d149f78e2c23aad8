"""Job: what is fixed for a print over a serial port before it begins."""

from dataclasses import dataclass

from machine.link.progress import Schedule
from machine.link.protocol.framing import LINE_LIMIT
from profiles.profile import Profile


@dataclass(frozen=True)
class PrintJob:
    """total: commands; limit: characters of a line that the firmware takes."""

    total: int | None = None
    schedule: Schedule | None = None
    limit: int = LINE_LIMIT
    profile: Profile | None = None
