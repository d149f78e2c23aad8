"""Timeouts: limits of the printer's answers in each state."""

from dataclasses import dataclass
from math import inf

from machine.firmware.firmware import LineRules
from machine.link.protocol.answers import QUESTION, QUESTIONS_MOST
from machine.link.protocol.states import Signal, State
from machine.link.protocol.window import LineInFlight, Window

QUIET_MOST_S = 2.0  # a printer with messages of its own must not hold up a repeat for ever
TURNS = 3.0  # round trips of silence after which nothing is left in flight


@dataclass(frozen=True)
class Timing:
    """Time limits of the printer's answers, s."""

    # Marlin sends `busy:` every 2 s. A question is harmless to a printer that is merely busy, so it is asked early even if the
    # printer never says so; how long such a printer may then be silent depends on its longest move.
    stall_s: float = 4.0
    stall_mute_s: float = 30.0
    sync_s: float = 3.0  # for an answer to M110, M115: a boot loader takes up to 2 s
    drain_s: float = 0.5  # silence after opening
    quiet_s: float = 0.12  # silence before a repeat: cable and ring buffer are empty by then
    complaint_s: float = 0.5  # from `Error:checksum...` to its Resend, and from that to its ok, which follow at once


class Timeouts:
    """Times of the newest byte, the newest progress and the beginning of the state, and the signals they give."""

    def __init__(self, timing: Timing, now_s: float) -> None:
        self._timing = timing
        self._round_trip_s = 0.0
        self._measured = self._busy_known = False
        self.heard_s = self.progress_s = self._entered_s = now_s
        self._resend_due_s = self._renumber_again_s = inf

    def enter(self, now_s: float) -> None:
        """Enter a state."""
        self._entered_s = self.progress_s = now_s
        self._resend_due_s = self._renumber_again_s = inf

    def hear_busy(self, now_s: float) -> None:
        """Note a busy report; with a printer that sends them, silence is noticed sooner."""
        self._busy_known, self.progress_s = True, now_s

    def hear_line_error(self, now_s: float) -> float:
        """Note a refused line, whose Resend is due soon; returns the time by which its ok is due."""
        self._resend_due_s = now_s + self._timing.complaint_s
        return self._resend_due_s

    def hear_resend(self, now_s: float, renumbering: bool) -> float:
        """Note a Resend; returns the time by which its ok is due. renumbering: M110 was refused and is repeated after a pause."""
        self._resend_due_s = inf
        if renumbering:
            self._renumber_again_s = now_s + self._timing.quiet_s
        return now_s + self._timing.complaint_s

    def acknowledge(self, line: LineInFlight, now_s: float) -> None:
        """Note an answered line. Among quick lines the shortest recent round trip counts, for the others waited in a queue."""
        self.progress_s, self._resend_due_s = now_s, inf
        if line.slow_timeout_s:
            return
        seconds = now_s - line.sent_s
        self._round_trip_s = min(1.05 * self._round_trip_s, seconds) if self._measured else seconds
        self._measured = True

    def signal(self, state: State, window: Window, rules: LineRules, questions: int, now_s: float) -> Signal | None:
        """The signal due to the time passed in a state, after a number of unanswered questions."""
        timing = self._timing
        if state is State.DRAIN:  # silence, or other messages for long enough
            return Signal.HUSH if self._silent_for(timing.drain_s, timing.sync_s, now_s) else None
        if state is State.QUIET:  # no more late lines
            silence_s = max(timing.quiet_s, TURNS * self._round_trip_s)
            return Signal.HUSH if self._silent_for(silence_s, QUIET_MOST_S, now_s) else None
        waited_s = now_s - self.progress_s
        if state in (State.SYNC, State.HELLO):
            return Signal.STALL if waited_s >= timing.sync_s else None
        if not window.flight and state is not State.RENUMBER:
            return None
        late = waited_s >= self._answer_s(state, window, rules, questions)
        return Signal.STALL if late or now_s >= min(self._resend_due_s, self._renumber_again_s) else None

    def _silent_for(self, silence_s: float, most_s: float, now_s: float) -> bool:
        """Whether there was silence for some time, or the state has reached its longest duration."""
        return now_s - self.heard_s >= silence_s or now_s - self._entered_s >= most_s

    def _answer_s(self, state: State, window: Window, rules: LineRules, questions: int) -> float:
        """Time limit of the awaited answer, s."""
        timing = self._timing
        known_s = timing.stall_s if self._busy_known else timing.stall_mute_s
        if state is not State.PROBING:
            # A printer in a long move reads nothing: a question must not overflow its buffer.
            return timing.stall_s if window.fits_buffer(QUESTION) else known_s
        if window.flight and (slow_s := window.flight[0].slow_timeout_s):
            # Answer and question may both be lost: with growing intervals a slow command's lost ok costs half a minute.
            return slow_s if questions >= QUESTIONS_MOST else min(slow_s, timing.stall_mute_s * 4.0 ** (questions - 1))
        if rules.silence_s is not None:
            return rules.silence_s
        # One of the first questions may be lost itself; the last ones outlast the longest move.
        return timing.stall_s if self._busy_known else 0.25 * timing.stall_mute_s * 2.0 ** (questions - 1)
