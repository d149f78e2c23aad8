"""Reports: what the printer tells while it prints: temperatures, its name, words of warning, what it asks for."""

from machine.link.control import Request, Wish
from machine.link.events import Action, Echo, Event, Identity, Ok, Temperature
from machine.link.watchdog import Watchdog
from profiles.errors import PrinterError

WARNINGS = 20  # kept of the printer's own words that show a program it does not understand
WARNS = ("nknown command", "too long extrusion")
COLD = ("cold extrusion prevented", "not driven because its heater")  # Marlin, RepRapFirmware; Klipper's is an error
ASKS = {"pause": Wish.PAUSE, "resume": Wish.RESUME, "cancel": Wish.CANCEL}
SILENT = {"paused", "resumed", "notification", "poweroff", "prompt_begin", "prompt_button", "prompt_show", "prompt_end"}


class Reports:
    """hear() every event; heard_s: when the newest temperature came."""

    def __init__(self, watchdog: Watchdog, now_s: float) -> None:
        self.temperature, self.firmware, self.heard_s = Temperature(), "unknown", now_s
        self.warnings: list[str] = []
        self._watchdog = watchdog

    def hear(self, event: Event, now_s: float) -> Request | None:
        """Take note; a request when the printer asks for something. Raises PrinterError when the print must end."""
        told = event.temperature if isinstance(event, Ok) else event
        if isinstance(told, Temperature):
            self.temperature, self.heard_s = told, now_s
            self._watchdog.saw(told, now_s)
        elif isinstance(event, Identity):
            self.firmware = event.text.removeprefix("FIRMWARE_NAME:").strip()
        elif isinstance(event, Echo):
            self._words(event.text)
        elif isinstance(event, Action):
            return self._asked(event)
        return None

    def wait(self, now_s: float, mute: bool) -> None:
        """Judge a silence; raises PrinterError. mute: nothing can be heard now."""
        self._watchdog.wait(now_s, mute)

    def _words(self, text: str) -> None:
        if any(words in text for words in COLD):
            raise PrinterError(
                f"the printer said {text!r}: the nozzle is too cold, the filament of a move is missing from the print"
            )
        if any(word in text for word in WARNS):
            self._warn(text)

    def _asked(self, action: Action) -> Request | None:
        if action.name == "disconnect":
            raise PrinterError("the printer asked to be disconnected (//action:disconnect)")
        if action.name not in ASKS and action.name not in SILENT:
            self._warn(f"action {action.name} {action.words}".strip())
        return Request(ASKS[action.name]) if action.name in ASKS else None

    def _warn(self, text: str) -> None:
        if len(self.warnings) < WARNINGS:
            self.warnings.append(text)
