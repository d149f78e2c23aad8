"""Moonraker's HTTP API (moonraker.readthedocs.io/en/latest/external_api; sources of 0.11), which drives Klipper.

401 means a wrong key; 403 for an upload, a file that is being printed. Klipper carries out orders in turn: a pause or
cancellation waits for the running command, even for heating, and is answered when it is done (docs/API_Server.md). An emergency
stop does not wait.
"""

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from machine.firmware.klipper import AXES as KLIPPER_AXES
from machine.link.identification import Answer, Kind
from machine.link.pending_commands import Command
from machine.link.print_state import PrintState, PrintStatus
from machine.link.protocol.events import NAME
from machine.printing.servers.http import entry, number, picture_address, table, temperature, whole
from machine.printing.servers.server import GcodeUpload, Identity, PrintServer, Sent
from profiles.errors import ServerError

READ_S = 300.0  # the server reads a whole file for its metadata before it answers
ORDERED_S = 120.0
STEPPER = "manual_stepper "
STATES = {
    "standby": PrintState.READY,
    "printing": PrintState.PRINTING,
    "paused": PrintState.PAUSED,
    "complete": PrintState.DONE,
    "cancelled": PrintState.CANCELLED,
    "error": PrintState.FAILED,
}
REPORTED = ("webhooks", "print_stats", "virtual_sdcard", "extruder", "heater_bed", "gcode_move")

ORDERS = {  # the meaning of each is defined by Klipper's macros PAUSE, RESUME and CANCEL_PRINT
    Command.PAUSE: "/printer/print/pause",
    Command.RESUME: "/printer/print/resume",
    Command.CANCEL: "/printer/print/cancel",
}


class Moonraker(PrintServer):
    """A Moonraker as a PrintServer."""

    key_header = "X-Api-Key"
    key_refused = (401,)
    tells_percents = True
    babystep = KLIPPER_AXES.babystep

    def greet(self) -> Identity:
        """Its version; axes, limits, steppers and commands if its Klipper is ready."""
        server = table(self._get("/server/info"))
        if "klippy_state" not in server:
            raise ServerError(f"{self.name} is not a Moonraker: it does not answer /server/info as one")
        text = f"Moonraker {server.get('moonraker_version') or ''}".strip()
        if server["klippy_state"] != "ready":
            return Identity(text, Answer(Kind.PRINTER, f"{NAME}Klipper"))
        version = str(table(self._get("/printer/info")).get("software_version") or "")
        objects = table(self._get("/printer/objects/list")).get("objects")
        names = frozenset(name for name in objects if isinstance(name, str)) if isinstance(objects, list) else frozenset()
        steppers = frozenset(name.removeprefix(STEPPER) for name in names if name.startswith(STEPPER))
        limits = self._limits() if "toolhead" in names else {}
        commands = self._commands() if "gcode" in names else None
        klipper = f"Klipper {version}".strip()
        printer = Answer(Kind.PRINTER, f"{NAME}{klipper}", "XYZ", limits)
        return Identity(f"{text}, {klipper}", printer, steppers, commands)

    def _commands(self) -> frozenset[str] | None:
        """All commands, macros included (klippy/gcode.py, get_status); None when Klipper is too old to report them."""
        commands = table(self._query(("gcode",)).get("gcode")).get("commands")
        return frozenset(name.upper() for name in commands) if isinstance(commands, dict) else None

    def _limits(self) -> dict[str, tuple[float, float]]:
        toolhead = table(self._query(("toolhead",)).get("toolhead"))
        pairs = ((number(entry(toolhead.get(f"axis_{end}"), k)) for end in ("minimum", "maximum")) for k in range(3))
        limits = zip("XYZ", (tuple(pair) for pair in pairs), strict=True)
        return {letter: (low, high) for letter, (low, high) in limits if low is not None and high is not None}

    def webcam(self) -> str:
        reply = self.get("/server/webcams/list")
        cameras = table(table(reply.json()).get("result")).get("webcams") if reply.status == 200 else None
        tables = (table(camera) for camera in cameras) if isinstance(cameras, list) else ()
        pictures = (picture_address(camera.get("snapshot_url"), self.address) for camera in tables if camera.get("enabled", True))
        return next(filter(None, pictures), "")

    def status(self) -> PrintStatus:
        """Status from Klipper's objects; from Moonraker while Klipper is not running."""
        server = table(self._get("/server/info"))
        if server.get("klippy_state") != "ready":
            return PrintStatus(PrintState.OFFLINE, message=self._trouble(server))
        objects = self._query(REPORTED)
        job, card, moves = (table(objects.get(name)) for name in ("print_stats", "virtual_sdcard", "gcode_move"))
        feed, flow = number(moves.get("speed_factor")), number(moves.get("extrude_factor"))
        return PrintStatus(
            STATES.get(str(job.get("state")), PrintState.READY),
            number(job.get("total_duration")) or 0.0,
            temperature(objects.get("extruder"), objects.get("heater_bed"), "temperature", "target"),
            file=str(job.get("filename") or ""),
            bytes_read=whole(card.get("file_position")),
            feed_percent=100.0 * (feed or 1.0),
            flow_percent=100.0 * (flow or 1.0),
            message=str(job.get("message") or ""),
            share=number(card.get("progress")),
        )

    def _trouble(self, server: Mapping[str, Any]) -> str:
        """Why Klipper cannot print."""
        if not server.get("klippy_connected"):
            return "Klipper does not run there"
        words = table(self.get("/printer/info").json()).get("result")
        return f"Klipper is in the state {server.get('klippy_state')}: {table(words).get('state_message') or 'no reason given'}"

    def has(self, file: str) -> bool:
        """Whether its folder holds a file of this name.

        /server/files/metadata answers 404 for a file not scanned yet (file_manager.py, _handle_metadata_request).
        """
        reply = self.get("/server/files/directory", {"path": "gcodes"})
        files = table(table(self._value(reply, "to list its files")).get("result")).get("files")
        return any(table(item).get("filename") == file for item in files) if isinstance(files, list) else False

    def upload(self, upload: GcodeUpload, sent: Sent) -> str:
        """Upload a file with its checksum, without which a truncated file would be accepted."""
        fields = {"root": "gcodes", "checksum": hashlib.sha256(upload.content).hexdigest()}
        reply = self.post_file("/server/files/upload", fields, upload.read_by(sent), READ_S, upload.name)
        sentences = {
            400: f"{self.name} does not take the file: {{words}}; it takes files up to max_upload_size of its [server]",
            403: f"{self.name} is printing a file of this name now, which cannot be replaced ({{words}})",
            422: f"{self.name} has received another file than was sent ({{words}}): send it again",
        }
        value = table(self.check(reply, "the file", sentences))
        path = table(value.get("item")).get("path")
        if not isinstance(path, str):
            raise ServerError(f"{self.name} has not said that it holds the file: send it again")
        return path

    def start(self, file: str) -> None:
        sentence = {400: f"{self.name} cannot start it now: {{words}}"}
        self._order("/printer/print/start", {"filename": file}, sentence)

    def order(self, command: Command) -> None:
        if command is Command.EMERGENCY_STOP:  # Klipper shuts down at once, whatever it is doing
            self._value(self.post("/printer/emergency_stop"), "the emergency stop")
        else:
            self._order(ORDERS[command])

    def command(self, line: str) -> None:
        """Execute a line of G-code, after the running command."""
        self._order("/printer/gcode/script", {"script": line})

    def settings(self) -> str:
        """Klipper's configuration and version (docs/Status_Reference.md, configfile)."""
        version = str(table(self._get("/printer/info")).get("software_version") or "")
        return json.dumps({"software_version": version, **self._query(("configfile",))})

    def _query(self, names: tuple[str, ...]) -> Mapping[str, Any]:
        reply = self.post("/printer/objects/query", {"objects": dict.fromkeys(names)})
        return table(table(table(self._value(reply, "to report its printer")).get("result")).get("status"))

    def _get(self, path: str) -> Any:
        return table(self._value(self.get(path), "to say who it is")).get("result")

    def _order(self, path: str, value: Mapping[str, Any] | None = None, sentences: Mapping[int, str] | None = None) -> None:
        reply = self.post(path, value, answer_s=ORDERED_S)
        self.check(reply, f"{path.rpartition('/')[2]}", sentences)

    def _value(self, reply: Any, purpose: str) -> Any:
        sentence = {503: f"{self.name} has lost its Klipper: {{words}}"}
        return self.check(reply, purpose, sentence)
