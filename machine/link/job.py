"""Job: what is fixed for a print before it begins, and where a resumed one goes on."""

from dataclasses import dataclass

from machine.link.framing import LINE_LIMIT
from machine.link.progress import Schedule
from profiles.profile import Profile


@dataclass(frozen=True)
class Begin:
    """Where a resumed print goes on: the first line of the program to be sent, and commands before it."""

    line: int
    before: tuple[str, ...]


@dataclass(frozen=True)
class Job:
    """What is fixed for a print. total: commands."""

    total: int | None = None
    schedule: Schedule | None = None
    limit: int = LINE_LIMIT
    profile: Profile | None = None
