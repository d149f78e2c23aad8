"""Streaming a program to a printer: checked first, fed as fast as the window allows, a barrier at the end, a safe way out."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from threading import Event as Flag

from machine.link.control import Control
from machine.link.feed import Feed
from machine.link.framing import LINE_LIMIT, command_of
from machine.link.inquiry import Found, inquire
from machine.link.job import Begin, Job
from machine.link.journal import Journal
from machine.link.medium import SERIAL, Medium
from machine.link.progress import Progress, Schedule
from machine.link.protocol import Timing
from machine.link.reconnect import found_again, lasting_name
from machine.link.shutdown import SETTLE_S, emergency_stop, heaters_off, lift
from machine.link.talk import Mended, Talk
from machine.link.wishes import CancelledError, EmergencyError
from profiles.errors import FirmwareError, PortError, PrinterError, SilenceError
from profiles.profile import Profile

__all__ = ["Begin", "Found", "Outcome", "print_lines"]

# After an error the printer may be deaf: the orders are given, the proof is not awaited for long. A halted or restarted
# firmware has switched its heaters off by itself.
PATIENCE_S: dict[type[PrinterError], float] = {FirmwareError: 1.0, SilenceError: 5.0}


@dataclass(frozen=True)
class Outcome:
    """How a print ended. heaters_off, after a cancel: whether the printer's own report proves it; None when
    the program ran to its own end, or when nothing of it had been sent.
    """

    cancelled: bool
    sent: int
    acknowledged: int
    repeated: int
    elapsed_s: float
    firmware: str
    warnings: tuple[str, ...]
    heaters_off: bool | None = None


def print_lines(
    lines: Iterable[str],
    port: str,
    baud: int = 115200,
    on_progress: Callable[[Progress], None] | None = None,
    stop: Flag | None = None,
    schedule: Schedule | None = None,
    total: int | None = None,
    timing: Timing | None = None,
    limit: int = LINE_LIMIT,
    *,
    control: Control | None = None,
    journal: Journal | None = None,
    profile: Profile | None = None,
    begin: Callable[[Found], Begin] | None = None,
    medium: Medium = SERIAL,
) -> Outcome:
    """Print a program: send every line's command, wait until the last one is done.

    What can be read twice (a sequence, a GcodeFile) is checked wholly before the port is opened, an iterator line by line as it
    is reached; lines are consumed lazily. A plain string is taken as its lines. schedule: for the time left, total: the
    number of commands where `lines` does not tell; limit: characters of a line, number and checksum included, that the firmware
    keeps. control: wishes of a person; journal: kept for a later resume; profile: lets a pause
    lift, park and cool the nozzle, and the watchdog know what is too hot; begin: for a resumed print, decides where it goes on.

    A set `stop` flag ends the print: feeding stops, moves are stopped, heaters and fan go off, the tip is lifted, nothing homes
    or turns; the Outcome says cancelled. KeyboardInterrupt does the same and is raised again. Raises LocalProtocolError for a
    line that cannot be sent, PortError, FirmwareError, RemoteProtocolError, SilenceError or PrinterError; the heaters are
    switched off first and the message says whether the printer confirmed it.
    """
    if isinstance(lines, str):
        lines = lines.splitlines()
    if not isinstance(lines, Iterator):
        total = sum(1 for place, line in enumerate(lines, 1) if command_of(line, place, limit))
    job = Job(total, schedule, limit, profile)
    feed = Feed(job, control, journal, on_progress, stop, medium.now_s())
    name = lasting_name(port)
    wire = medium.open(port, baud)
    rx_bytes = None if profile is None else profile.machine.receive_bytes - 1  # a ring holds one byte less than its size
    finder = _Finder(feed, name, baud, medium)
    talk = Talk(wire, medium, timing or Timing(), feed.heard, feed.turned, finder, limit, rx_bytes, baud)
    feed.talk = talk
    try:
        return _Print(feed, talk, medium, journal).run(lines, begin)
    finally:
        talk.wire.close()


class _Finder:
    """Waits for a lost port. A firmware that cannot be asked by line number is asked for its place instead."""

    def __init__(self, feed: Feed, name: str, baud: int, medium: Medium) -> None:
        self._feed, self._name, self._baud, self._medium = feed, name, baud, medium

    def __call__(self, error: PortError) -> Mended:
        feed, medium = self._feed, self._medium
        feed.talk.wire.close()
        end_s = medium.now_s() + medium.lost_s
        with feed.apart("reconnecting", f"{error}; waiting {medium.lost_s:.0f} s for it to come back"):
            while medium.now_s() < end_s and (wire := found_again(self._name, self._baud, medium, feed.heed)) is not None:
                if feed.talk.protocol.family.resends:
                    return Mended(wire, None)
                feed.talk.wire = wire  # whoever cancels meanwhile wants the heaters off
                try:
                    return Mended(wire, feed.was_done(inquire(wire, medium, feed.heed)))
                except PortError:  # a plug that is still loose, or a printer that has stopped reading
                    wire.close()
        raise PortError(f"{error}; it did not come back within {medium.lost_s:.0f} s")


@dataclass
class _Print:
    """The ways a print can end, each leaving the printer safe."""

    feed: Feed
    talk: Talk
    medium: Medium
    journal: Journal | None

    def run(self, lines: Iterable[str], begin: Callable[[Found], Begin] | None) -> Outcome:
        began_s = self.medium.now_s()
        try:
            if begin is not None:
                self.feed.begin = begin(inquire(self.talk.wire, self.medium, self.feed.heed))
            self.talk.greet()
            self.feed.run(lines)
        except CancelledError:
            return self._outcome(began_s, self._cancelled())
        except EmergencyError:
            raise FirmwareError(self._stopped()) from None
        except PrinterError as error:
            if not self.feed.begun:
                raise
            raise type(error)(f"{error}; {self._left(error)}{self._hint()}") from None
        except BaseException:
            if self.feed.begun:
                self._abandon(SETTLE_S)
            raise
        return self._outcome(began_s, None)

    def _cancelled(self) -> bool | None:
        if not self.feed.begun:
            return None
        self.feed.turn_to("cancelling")
        return self._abandon(SETTLE_S)

    def _stopped(self) -> str:
        """The emergency stop, in words."""
        halted = emergency_stop(self.talk.wire, self.medium)
        self.feed.turn_to("cancelling")
        if halted:
            return "emergency stop: the printer has halted; switch it off and on before the next print"
        return "emergency stop: the printer did not confirm M112: cut the power"

    def _left(self, error: PrinterError) -> str:
        """Heaters off before an error goes its way; words on whether the printer proved it."""
        gone = isinstance(error, PortError)
        off = not gone and self._abandon(PATIENCE_S.get(type(error), SETTLE_S), not isinstance(error, FirmwareError))
        return "the printer reports its heaters off" if off else "its heaters may still be on, look at the printer"

    def _abandon(self, patience_s: float, known: bool = True) -> bool:
        """Heaters off, the tip lifted where the printer is alive and knows its place; True when the heaters are proved off."""
        try:
            off = heaters_off(self.talk.wire, self.medium, patience_s)
            away = self.feed.lift() if off and known else None
            if away is not None:
                self.feed.left(lift(self.talk.wire, self.medium, *away))
            return off
        except PortError:
            return False

    def _hint(self) -> str:
        """How to go on with what is half printed."""
        if self.journal is None or not self.feed.trail.executed:
            return ""
        return f"; tiltprint resume {self.journal.path} goes on with it"

    def _outcome(self, began_s: float, off: bool | None) -> Outcome:
        feed = self.feed
        return Outcome(
            cancelled=not feed.finished,
            sent=feed.sent,
            acknowledged=feed.acknowledged,
            repeated=self.talk.protocol.repeated,
            elapsed_s=self.medium.now_s() - began_s,
            firmware=feed.reports.firmware,
            warnings=tuple(feed.reports.warnings),
            heaters_off=off,
        )
