"""Pause: leave the print, wait until the user resumes, return to the same place.

Meanwhile the motors are kept on; the nozzle of an unattended pause is switched off because it would ooze and char.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import inf

from machine.firmware import dialect_of
from machine.gcode.commands import command_in
from machine.gcode.modes import Coordinates, ModalState
from machine.gcode.pen import number
from machine.link.exchange import Exchange
from machine.link.pause.park_moves import COLD_C, NEAR_C, extrudes, fill_commands, heat_commands, plan_park
from machine.link.pause.printed_bounds import PrintedBounds
from machine.link.pending_commands import PendingCommands
from machine.link.print_state import PrintState
from machine.link.watchdog import PrinterReports
from profiles.profile import Profile

AWAKE_S = 60.0  # half of the shortest idle time, Marlin's DEFAULT_STEPPER_TIMEOUT_SEC


@dataclass
class Pause:
    """A pause from the last move of the print to the next one."""

    exchange: Exchange
    pending: PendingCommands
    reports: PrinterReports
    modal: ModalState  # the firmware's state where the print stopped, with the user's changes
    profile: Profile | None
    stands: Coordinates | None = None  # X Y Z tilt turn E where the tip waits, None on its way
    aside: bool = False  # the tip has left the print
    off: bool = False  # the nozzle was switched off
    printing_c: float = 0.0  # the nozzle's target where the print stopped

    def run(self, bounds: PrintedBounds | None, why: str) -> Iterator[tuple[PrintState, str]]:
        """Run the pause; yields each state with the message to show. bounds: the printed region."""
        modal, bed_c, self.printing_c = self.modal, self.modal.bed_c, self.modal.nozzle_c
        away, back, park = plan_park(modal, self.profile, bounds)
        self._send(away)
        self.exchange.drain()
        self.aside = park is not None
        self.stands = (*park.stand_mm, *modal.at[3:]) if park is not None else modal.coordinates()
        yield PrintState.PAUSED, why
        for words in self._wait(why):
            yield PrintState.PAUSED, words
        # A heater that the user switches off is off for the pause only: the print cannot continue cold.
        modal.nozzle_c, modal.bed_c = modal.nozzle_c or self.printing_c, modal.bed_c or bed_c
        cooled = modal.nozzle_c > 0 and (self.off or self._has_cooled())
        yield PrintState.RESUMING, f"the nozzle is {self._heating()}" if cooled else ""
        self._send(heat_commands(modal, self.profile))
        if cooled and self._fills() and self.profile is not None:
            self._send(fill_commands(modal, self.profile))
        self.exchange.drain()
        self.stands, self.aside = None, False
        yield PrintState.RESUMING, ""
        self._send((*back, *modal.lines()))

    def _wait(self, why: str) -> Iterator[str]:
        """Wait until the print resumes; yields each new message."""
        pending, exchange, now_s = self.pending, self.exchange, self.exchange.medium.now_s
        awake = exchange.connection.greeting.keep_awake
        awake_s, since_s = now_s(), now_s()
        while pending.lines or not pending.resume:
            if awake and now_s() >= awake_s:
                exchange.send(awake)
                awake_s = now_s() + AWAKE_S
            if pending.lines:
                refused = self._send_own()
                since_s = now_s()
                yield refused or self._words(why)
            elif now_s() >= since_s + self._cools_after_s():
                self._switch_off()
                yield self._words(why)
            due_s = min(awake_s if awake else inf, since_s + self._cools_after_s())
            exchange.wait(due_s - now_s(), until=lambda: pending.resume or bool(pending.lines))

    def _cools_after_s(self) -> float:
        """Time after which an unattended nozzle is switched off, s."""
        minutes = self.profile.machine.pause_cools_after_min if self.profile is not None else 0.0
        return 60.0 * minutes if minutes and self.modal.nozzle_c > 0 and not self.off else inf

    def _switch_off(self) -> None:
        if self.profile is not None:
            self.exchange.send(dialect_of(self.profile.machine).nozzle.format(number(0.0)))
            self.off = True

    def _send_own(self) -> str:
        """Send the user's commands; returns why one was refused, or "": firmwares end a print at cold extrusion."""
        refused = ""
        for command in self.pending.next_lines(self.modal):
            row = command_in(command)
            if row.moves == "path":
                self.exchange.send("M105")
                self.exchange.settle()  # heating is waited for
                if self._is_cold():
                    nozzle_c = self.reports.temperature.nozzle_c
                    refused = f"not sent: {command[:40]!r}: the nozzle has only {nozzle_c:.0f} °C: heat it first (M109)"
                    continue
            self.exchange.send(command)
            self.off = self.off and row.heats not in ("nozzle", "named")
        return refused

    def _is_cold(self) -> bool:
        """Whether the nozzle is too cold to extrude."""
        nozzle_c, hot_c = self.reports.temperature.nozzle_c, self.modal.nozzle_c or self.printing_c
        return nozzle_c is not None and nozzle_c < (min(COLD_C, hot_c - NEAR_C) if hot_c else COLD_C)

    def _has_cooled(self) -> bool:
        """Whether the user or the firmware switched the nozzle off."""
        return self._is_cold() and (self.profile is None or self.profile.material.standby_c is None)

    def _words(self, why: str) -> str:
        """The reason of the pause, and what happens when it ends."""
        if not self.off or self.profile is None:
            return why
        minutes = self.profile.machine.pause_cools_after_min
        cooled = f"the nozzle was switched off after {minutes:g} min; when the print continues it is {self._heating()}"
        return f"{why}; {cooled}" if why else cooled

    def _heating(self) -> str:
        filled = " and filled where the tip waits: take the drop off" if self._fills() else ""
        return f"heated to {self.modal.nozzle_c:g} °C{filled}"

    def _fills(self) -> bool:
        """Whether a cooled nozzle is filled before it goes back."""
        return self.aside and extrudes(self.modal, self.profile)

    def _send(self, commands: Iterable[str]) -> None:
        for command in commands:
            self.exchange.send(command)
