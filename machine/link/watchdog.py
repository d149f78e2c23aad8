"""Watchdog: a printer's reports that end the print: temperatures that stay away from their targets or are no longer reported,
cold extrusion, a request to disconnect.

Firmwares guard their heaters themselves (Marlin: 40 s beyond 4 K, 20 s without a rise of 2 K); the limits here are wider, and
only matter where the firmware's are missing or fail.
"""

from dataclasses import dataclass, replace
from math import inf

from machine.gcode.commands import command_named
from machine.gcode.words import split_command
from machine.link.pending_commands import Command, PendingCommand
from machine.link.protocol.events import Event, Kind, Temperature
from profiles.errors import PrinterError

SILENCE_S = 120.0  # a report is requested every few seconds: as many queries do not stay unanswered by chance
OVER_LIMIT_C = 15.0
OVER_REPORTS = 2  # in a row: a lost byte makes 200 of 20.0 once
WARNINGS = 20  # remembered messages about commands that the printer does not know
WARNS = ("nknown command", "too long extrusion")
COLD = ("cold extrusion prevented", "not driven because its heater")  # Marlin, RepRapFirmware; Klipper's is an error
ASKS = {"pause": Command.PAUSE, "resume": Command.RESUME, "cancel": Command.CANCEL}
SILENT = {"paused", "resumed", "notification", "poweroff", "prompt_begin", "prompt_button", "prompt_show", "prompt_end"}


@dataclass
class HeaterWatch:
    """A heater's approach to its target."""

    name: str
    off_c: float  # tolerated deviation, K,
    off_s: float  # and its duration
    nearer_c: float = 2.0  # smallest approach that counts as progress, K
    target_c: float | None = None
    nearest_c: float = inf  # smallest deviation since the target was set or reached
    nearest_s: float = 0.0  # when that was
    over: int = 0  # reports in a row beyond the machine's limit

    def check(self, now_c: float | None, target_c: float | None, now_s: float) -> None:
        """Judge a report. Raises PrinterError."""
        if now_c is None or not target_c:
            self.target_c = None
            return
        off = abs(now_c - target_c)
        if target_c != self.target_c or off <= self.off_c:
            self.target_c, self.nearest_c, self.nearest_s = target_c, max(off, self.off_c), now_s
        elif off <= self.nearest_c - self.nearer_c:
            self.nearest_c, self.nearest_s = off, now_s
        elif now_s - self.nearest_s > self.off_s:
            raise PrinterError(
                f"the {self.name} has been at {now_c:.0f} °C for {now_s - self.nearest_s:.0f} s although {target_c:.0f} is "
                "wanted: its heater or its sensor has failed"
            )


class PrinterReports:
    """Judges a printer's reports: read() every event, check_silence() regularly.

    most_c: greatest temperatures of nozzle and bed, deg C. temperature_s: time of the newest temperature; unknown: commands that
    the firmware does not know; waiting: what the printer waits for the user to do, "" for nothing.
    """

    def __init__(self, now_s: float, most_c: tuple[float, float] = (inf, inf)) -> None:
        self.temperature, self.firmware, self.temperature_s = Temperature(), "unknown", now_s
        self.unknown: set[str] = set()
        self.waiting = ""
        self._warned: dict[str, int] = {}
        self._most_c = most_c
        self._heaters = HeaterWatch("nozzle", 20.0, 60.0), HeaterWatch("bed", 15.0, 180.0, 1.0)
        self._silent_since_s: float | None = None  # None: nothing was ever reported

    def read(self, event: Event, now_s: float) -> PendingCommand | None:
        """Note an event; returns a command when the printer requests one. Raises PrinterError when the print must end."""
        if event.kind is Kind.OK:
            self.waiting = ""
            if event.temperature is None and not event.identity:  # most answers: an ok with nothing else
                return None
        elif event.kind is Kind.BUSY:
            # Marlin's PAUSED_FOR_USER and PAUSED_FOR_INPUT: filament runout, M0, a question on its display.
            self.waiting = "the printer waits for you: look at its display" if "paused for" in event.text else ""
        if event.temperature is not None:
            self._check(event.temperature, now_s)
        if event.identity:
            self.firmware = event.identity.removeprefix("FIRMWARE_NAME:").strip()
        elif unknown := event.unknown_command:
            self.unknown.add(unknown)
            # Marlin has M73 and M486 only when built with SET_PROGRESS_MANUALLY and CANCEL_OBJECTS (Configuration_adv.h), which
            # are off by default.
            if not command_named(unknown).shows:
                self._warn(f"Unknown command: {unknown}")
        elif event.kind is Kind.ECHO:
            self._read_echo(event.text)
        elif event.kind is Kind.ACTION:
            return self._read_action(event.text)
        return None

    def _check(self, report: Temperature, now_s: float) -> None:
        """Judge the temperatures. Raises PrinterError."""
        self.temperature, self.temperature_s, self._silent_since_s = report, now_s, now_s
        pairs = ((report.nozzle_c, report.nozzle_target_c), (report.bed_c, report.bed_target_c))
        for heater, most_c, (now_c, target_c) in zip(self._heaters, self._most_c, pairs, strict=True):
            heater.over = heater.over + 1 if now_c is not None and now_c > most_c + OVER_LIMIT_C else 0
            if heater.over >= OVER_REPORTS:
                raise PrinterError(f"the {heater.name} is at {now_c:.0f} °C: this machine allows at most {most_c:g}")
            if not heater.over:
                heater.check(now_c, target_c, now_s)

    def check_silence(self, now_s: float, mute: bool = False) -> None:
        """Raise PrinterError for silence while a heater is on, unless the printer never reported or cannot report now (mute)."""
        if mute and self._silent_since_s is not None:
            self._silent_since_s = now_s
        silent_s = 0.0 if self._silent_since_s is None else now_s - self._silent_since_s
        if silent_s > SILENCE_S and any(heater.target_c for heater in self._heaters):
            raise PrinterError(f"the printer has reported no temperature for {silent_s:.0f} s although a heater is on")

    def note_off(self) -> None:
        """Note that the heaters are proved off, by a report from outside of the conversation."""
        bed_c = None if self.temperature.bed_target_c is None else 0.0
        self.temperature = replace(self.temperature, nozzle_target_c=0.0, bed_target_c=bed_c)

    def leaves_out(self, command: str) -> bool:
        """Whether a command that the firmware does not know can be omitted: no heat, move, mode or waiting."""
        if not self.unknown:
            return False
        name = split_command(command.upper())[0]
        return name in self.unknown and (command_named(name).shows or command_named(name).tunes)

    @property
    def warnings(self) -> list[str]:
        """The printer's messages about commands that it does not know; repetitions are counted."""
        return [text if count == 1 else f"{text} (x {count})" for text, count in self._warned.items()]

    def _read_echo(self, text: str) -> None:
        if any(words in text for words in COLD):
            raise PrinterError(
                f"the printer said {text!r}: the nozzle is too cold, the filament of a move is missing from the print"
            )
        if any(word in text for word in WARNS):
            self._warn(text)

    def _read_action(self, action: str) -> PendingCommand | None:
        name = action.partition(" ")[0]
        if name == "disconnect":
            raise PrinterError("the printer asked to be disconnected (//action:disconnect)")
        if name not in ASKS and name not in SILENT:
            self._warn(f"action {action}")
        return PendingCommand(ASKS[name]) if name in ASKS else None

    def _warn(self, text: str) -> None:
        if text in self._warned or len(self._warned) < WARNINGS:
            self._warned[text] = self._warned.get(text, 0) + 1
