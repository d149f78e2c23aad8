"""OctoPrint's REST API (docs.octoprint.org/en/master/api; octoprint/server/api of 1.11.8).

403 means a missing or wrong key. A file has temporary names until it is complete. The flag `printing` of /api/printer is true in
all phases of a print, so the other flags are evaluated first.
"""

from collections.abc import Mapping
from typing import Any

from machine.link.pending_commands import Command
from machine.link.print_state import PrintState, PrintStatus
from machine.printing.servers.http import number, picture_address, table, temperature, whole
from machine.printing.servers.server import GcodeUpload, Identity, PrintServer, Sent
from profiles.errors import ServerError

STORED_S = 120.0  # the server copies and reads a file before it answers
FLAGS = (
    ("cancelling", PrintState.CANCELLING),
    ("pausing", PrintState.PAUSING),
    ("resuming", PrintState.RESUMING),
    ("finishing", PrintState.FINISHING),
    ("paused", PrintState.PAUSED),
    ("printing", PrintState.PRINTING),
)

ORDERS = {  # path, value, and the name of the order in a refusal
    Command.PAUSE: ("/api/job", {"command": "pause", "action": "pause"}, "to pause"),
    Command.RESUME: ("/api/job", {"command": "pause", "action": "resume"}, "to resume"),
    Command.CANCEL: ("/api/job", {"command": "cancel"}, "to cancel"),  # its own script switches the heaters off
    Command.EMERGENCY_STOP: ("/api/printer/command", {"command": "M112"}, "M112"),  # sent ahead of its queue
}


class OctoPrint(PrintServer):
    """An OctoPrint as a PrintServer."""

    key_header = "X-Api-Key"
    hides_answers = True  # its REST API shows neither answers nor capabilities of the firmware

    def greet(self) -> Identity:
        """Its version; the API does not report the firmware."""
        value = self._get("/api/version", "to say who it is")
        text = value.get("text") if isinstance(value, dict) else None
        if not isinstance(text, str) or not text.startswith("OctoPrint"):
            raise ServerError(f"{self.name} is not an OctoPrint: it does not answer /api/version as one")
        if "moonraker" in text.lower():
            raise ServerError(f"{self.name} is a Moonraker that speaks as OctoPrint: use moonraker:HOST")
        return Identity(text)

    def webcam(self) -> str:
        reply = self.get("/api/settings")  # some keys may not read the settings
        settings = table(reply.json()) if reply.status == 200 else {}
        return picture_address(table(settings.get("webcam")).get("snapshotUrl"), self.address)

    def status(self) -> PrintStatus:
        """Status from /api/job, and from /api/printer while a printer is connected."""
        job = table(self._get("/api/job", "to report its print"))
        progress, file = table(job.get("progress")), table(table(job.get("job")).get("file"))
        reply = self.get("/api/printer", {"exclude": "sd"})
        printer = {} if reply.status == 409 else table(self.check(reply, "to report its printer"))
        heaters, done = table(printer.get("temperature")), number(progress.get("completion"))
        return PrintStatus(
            _phase(table(table(printer.get("state")).get("flags")), progress),
            number(progress.get("printTime")) or 0.0,
            file=str(file.get("path") or ""),
            bytes_read=whole(progress.get("filepos")),
            temperature=temperature(heaters.get("tool0"), heaters.get("bed"), "actual", "target"),
            message=str(job.get("error") or ("" if printer else f"its printer is not connected ({job.get('state')})")),
            share=None if done is None else done / 100.0,
        )

    def has(self, file: str) -> bool:
        reply = self.get(f"/api/files/local/{file}")
        return reply.status != 404 and self.check(reply, "to list its files") is not None

    def upload(self, upload: GcodeUpload, sent: Sent) -> str:
        """Upload a file; returns the name chosen by the server."""
        reply = self.post_file("/api/files/local", {}, upload.read_by(sent), STORED_S, upload.name)
        sentence = {409: f"{self.name} is printing a file of this name now, which cannot be replaced ({{words}})"}
        value = table(self.check(reply, "the file", sentence))
        local = table(table(value.get("files")).get("local"))
        if not value.get("done") or not isinstance(local.get("path"), str):
            raise ServerError(f"{self.name} has not said that it holds the whole file: send it again")
        return str(local["path"])

    def start(self, file: str) -> None:
        sentence = {409: f"{self.name} cannot start it now: {{words}}"}
        self._order(f"/api/files/local/{file}", {"command": "select", "print": True}, "to start it", sentence)

    def order(self, command: Command) -> None:
        self._order(*ORDERS[command])

    def command(self, line: str) -> None:
        self._order("/api/printer/command", {"command": line}, line)

    def _get(self, path: str, purpose: str) -> Any:
        return self.check(self.get(path), purpose)

    def _order(self, path: str, value: Mapping[str, Any], purpose: str, refused: Mapping[int, str] | None = None) -> None:
        sentences = refused or {409: f"{self.name} refuses {purpose}: {{words}}"}
        self.check(self.post(path, value), purpose, sentences)


def _phase(flags: Mapping[str, Any], progress: Mapping[str, Any]) -> PrintState:
    if not flags.get("operational"):
        return PrintState.OFFLINE
    for flag, phase in FLAGS:
        if flags.get(flag):
            return phase
    done = number(progress.get("completion"))
    return PrintState.DONE if done is not None and done >= 100.0 else PrintState.READY
