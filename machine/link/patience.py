"""Patience: how long the sender waits for what, and since when."""

from dataclasses import dataclass

from machine.link.families import Family
from machine.link.states import State
from machine.link.window import Window

QUIET_MOST_S = 2.0  # a printer that chatters on its own must not hold up a repeat for ever
TURNS = 3.0  # round trips of silence after which nothing is on its way any more
QUESTION = "M105"
PROBES = 4  # questions in a row without any answer before the printer counts as gone


@dataclass(frozen=True)
class Timing:
    """How long the sender is patient, s."""

    # Marlin says `busy:` every 2 s. A question does no harm to a printer that has only no time, so it is asked early of
    # one that never says so, too; but how long that one may then stay silent depends on its longest move.
    stall_s: float = 4.0
    stall_mute_s: float = 30.0
    sync_s: float = 3.0  # for an answer to M110, M115: a boot loader takes up to 2 s
    drain_s: float = 0.5  # of silence after opening
    quiet_s: float = 0.12  # of silence before a repeat: the lines still in the cable and the ring have been flushed then
    complaint_s: float = 0.5  # from `Error:checksum...` to its Resend, and from there to its ok: they come in one breath


class Patience:
    """Times of the clock handed in: when something was heard, when something was achieved, when the state began."""

    def __init__(self, timing: Timing, now_s: float) -> None:
        self._timing = timing
        self._round_trip_s = 0.0
        self._measured = False
        self.busy_known = False
        self.heard_s = self.progress_s = self.entered_s = now_s

    def drained(self, now_s: float) -> bool:
        """Whether old words have run dry, or chatter has been listened to for long enough."""
        return now_s - self.heard_s >= self._timing.drain_s or now_s - self.entered_s >= self._timing.sync_s

    def quiet(self, now_s: float) -> bool:
        """Whether late lines have run dry."""
        silence_s = max(self._timing.quiet_s, TURNS * self._round_trip_s)
        return now_s - self.heard_s >= silence_s or now_s - self.entered_s >= QUIET_MOST_S

    def greeted_late(self, now_s: float) -> bool:
        """Whether a greeting stays without answer."""
        return now_s - self.progress_s >= self._timing.sync_s

    def over(self, now_s: float, state: State, window: Window, family: Family, asked: int) -> bool:
        """Whether an answer is overdue after so many questions."""
        return now_s - self.progress_s >= self._wait_s(state, window, family, asked)

    def took(self, seconds: float) -> None:
        """A quick line was answered after this time; the least of the last ones counts, for the others waited in a queue."""
        self._round_trip_s = min(1.05 * self._round_trip_s, seconds) if self._measured else seconds
        self._measured = True

    def _wait_s(self, state: State, window: Window, family: Family, asked: int) -> float:
        timing = self._timing
        known_s = timing.stall_s if self.busy_known else timing.stall_mute_s
        if state is not State.PROBING:
            # A printer in a long move reads nothing: a question must not overflow its buffer.
            return timing.stall_s if window.holds(QUESTION) else known_s
        if window.flight and (budget_s := window.flight[0].budget_s):
            # Answer and question may both be lost: asked again ever later, a slow command's lost ok costs half a minute.
            return budget_s if asked >= PROBES else min(budget_s, timing.stall_mute_s * 4.0 ** (asked - 1))
        if family.silence_s is not None:
            return family.silence_s
        # Of the first questions one may be lost itself; the last ones wait out the longest move.
        return timing.stall_s if self.busy_known else 0.25 * timing.stall_mute_s * 2.0 ** (asked - 1)
