"""Requests rr_ of a Duet: RepRapFirmware alone, or DuetSoftwareFramework, whose web server answers them too.

According to RepRapFirmware (src/Networking/HttpResponder.cpp, GCodes/GCodeInput.cpp, "HTTP requests.md" and the object model of
PrintMonitor.cpp) and DuetSoftwareFramework (RepRapFirmwareController.cs); never tried on a board. A session ends after 8 s
without a request, so a 401 begins a new one. A file is written as NAME.part and renamed when length and CRC are right. M112 is
recognised as its characters arrive, whatever waits. A print can only be cancelled while paused (M25, then M0).
"""

import json
import time
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from machine.firmware.reprapfirmware import DIALECT
from machine.link.identification import Answer, Kind
from machine.link.pending_commands import Command
from machine.link.print_state import AWAY, PrintState, PrintStatus
from machine.link.protocol.events import NAME
from machine.printing.destination import Server
from machine.printing.servers.http import Reply, Tell, entry, how_to_give_a_key, number, plain, table, temperature, whole
from machine.printing.servers.server import GcodeUpload, Identity, PrintServer, Sent
from profiles.errors import ServerError

FOLDER = "0:/gcodes/"
DEFAULT_PASSWORD = "reprap"  # password of a board without one, which must be sent nevertheless
WRITTEN_S = 120.0
START_S, PAUSE_S, LOOK_S = 3.0, 120.0, 0.25
MOST_PAGES = 16
SETTINGS_ARRAYS = ("move.axes", "move.extruders", "tools", "sensors.probes")
SETTINGS_KEYS = ("boards[0]", "heat", "move.kinematics", "network")
STOPPED = AWAY | {PrintState.CANCELLING}
STATES = {
    "idle": PrintState.READY,
    "processing": PrintState.PRINTING,
    "simulating": PrintState.PRINTING,
    "pausing": PrintState.PAUSING,
    "paused": PrintState.PAUSED,
    "resuming": PrintState.RESUMING,
    "cancelling": PrintState.CANCELLING,
    **dict.fromkeys(("halted", "off", "updating", "starting", "disconnected"), PrintState.OFFLINE),
}

ORDERS = {Command.PAUSE: "M25", Command.RESUME: "M24", Command.CANCEL: "M25", Command.EMERGENCY_STOP: "M112"}


class Duet(PrintServer):
    """A Duet as a PrintServer."""

    babystep = DIALECT.babystep

    def __init__(self, address: Server, key: str = "", ca_file: Path | None = None, tell: Tell | None = None) -> None:
        super().__init__(address, key, ca_file, tell)
        self._nozzle, self._bed = 1, 0  # heater numbers
        self._connected = False
        self._last: PrintState | None = None  # last state of the print: "idle" does not say how it ended
        self._up_s = 0.0  # time since the board's reset, s

    def greet(self) -> Identity:
        """Log in; read firmware, axes with their limits, and the heaters of nozzle and bed."""
        self._connect()
        board = table(self._model("boards[0]"))
        name, version = str(board.get("firmwareName") or "RepRapFirmware"), str(board.get("firmwareVersion") or "")
        axes = [table(axis) for axis in self._array("move.axes")]
        limits = {str(axis.get("letter")): (number(axis.get("min")), number(axis.get("max"))) for axis in axes}
        known = {letter: (low, high) for letter, (low, high) in limits.items() if low is not None and high is not None}
        nozzle = whole(entry(table(entry(self._array("tools"), 0)).get("heaters"), 0))
        bed = whole(entry(table(self._model("heat")).get("bedHeaters"), 0))
        self._nozzle, self._bed = self._nozzle if nozzle is None else nozzle, -1 if bed is None else bed
        text = f"{name} {version}".strip()
        return Identity(text, Answer(Kind.PRINTER, f"{NAME}{text}", "".join(limits), known))

    def _connect(self) -> None:
        password = self.key or DEFAULT_PASSWORD
        now = time.strftime("%Y-%m-%dT%H:%M:%S")
        reply = self.get("/rr_connect", {"password": password, "time": now, "sessionKey": "yes"}, secret=True)
        value = table(self.check(reply, "a session"))
        if value.get("err") == 1:
            wrong = "refuses the password" if self.key else "wants a password"
            raise ServerError(f"{self.name} {wrong}: {how_to_give_a_key(self.address)}")
        if value.get("err") == 2:
            raise ServerError(f"{self.name} serves as many others as it can: close a web page or program that is connected to it")
        if value.get("err") != 0:
            raise ServerError(f"{self.name} is not a Duet: it does not answer rr_connect as one")
        self._connected = True
        key = whole(value.get("sessionKey"))
        if key:  # firmware from 3.5; earlier, and with DuetSoftwareFramework, a session belongs to this computer's address
            self.client.headers["X-Session-Key"] = str(key)

    def status(self) -> PrintStatus:
        """Status from the frequently changing values of the object model."""
        before = self._last  # an answer sent before the print began does not mark its end
        model = table(table(self._value("/rr_model", {"flags": "d99fn"})).get("result"))
        job, machine_state = table(model.get("job")), table(model.get("state"))
        state, up_s = str(machine_state.get("status") or ""), number(machine_state.get("upTime"))
        if up_s is not None:
            if up_s < self._up_s:  # the board was reset (RepRap.cpp): idle is not the end of the print
                before = self._last = None
            self._up_s = up_s
        elapsed_s = number(job.get("duration"))
        under_way = (
            PrintState.READY if elapsed_s is None else PrintState.PRINTING
        )  # busy, changingTool: inside or outside a print
        phase = STATES.get(state, under_way)
        heaters, said = table(model.get("heat")).get("heaters"), self._get("/rr_reply")
        words = plain(said.body.decode("utf-8", "replace")) if said.status == 200 else ""
        return PrintStatus(
            self._since_start(phase, before),
            bytes_read=whole(job.get("filePosition")),
            elapsed_s=elapsed_s or 0.0,
            temperature=temperature(entry(heaters, self._nozzle), entry(heaters, self._bed), "current", "active"),
            message=words or (f"it is {state}" if phase is PrintState.OFFLINE else ""),
        )

    def file_in_print(self) -> str:
        """Name of the printed file, job.file.fileName, which is not among the frequently changing values."""
        path = self._model("job.file.fileName")
        return path.removeprefix(FOLDER) if isinstance(path, str) else ""

    def _since_start(self, phase: PrintState, before: PrintState | None) -> PrintState:
        """The phase, with idle after a print as its end: a cancelled print was paused before. before: the previous phase."""
        if phase.is_printing:
            self._last = phase
        if phase is not PrintState.READY or before is None or self._last is None:
            return phase
        return PrintState.CANCELLED if self._last in STOPPED else PrintState.DONE

    def has(self, file: str) -> bool:
        return table(self._value("/rr_fileinfo", {"name": FOLDER + file})).get("err") == 0

    def upload(self, upload: GcodeUpload, sent: Sent) -> str:
        self._connect()  # the earlier session may have ended while the program was made
        crc32 = f"{zlib.crc32(upload.content):08x}"  # eight digits: DuetSoftwareFramework compares text
        params = {"name": FOLDER + upload.name, "crc32": crc32}
        reply = self.post_file("/rr_upload", params, upload.read_by(sent), WRITTEN_S)
        if table(self.check(reply, "the file")).get("err") != 0:
            said = plain(self._get("/rr_reply").body.decode("utf-8", "replace"))
            raise ServerError(f"{self.name} has not kept the file ({said or 'no reason given'}): is the card full or damaged?")
        return upload.name

    def start(self, file: str) -> None:
        self._last = None
        self.command(f'M32 "{FOLDER}{file}"')
        deadline_s = time.monotonic() + START_S
        while time.monotonic() < deadline_s:
            try:
                status = self.status()
            except ServerError:  # the order was sent: its status shows whether it prints
                return
            if "Error" in status.message:
                raise ServerError(f"{self.name} cannot start it now: {status.message}")
            if status.state.is_printing:
                return
            time.sleep(LOOK_S)

    def order(self, command: Command) -> None:
        """Give an order. A print is paused, then cancelled; the firmware then runs cancel.g, or switches the heaters off."""
        self.command(ORDERS[command])
        if command is not Command.CANCEL:
            return
        deadline_s = time.monotonic() + PAUSE_S
        while (phase := self.status().state) in (PrintState.PRINTING, PrintState.PAUSING, PrintState.RESUMING):
            if time.monotonic() > deadline_s:
                raise ServerError(f"{self.name} has not paused within {PAUSE_S:g} s, and cancels only then: look at it")
            time.sleep(LOOK_S)
        if phase is PrintState.PAUSED:
            self.command("M0")

    def command(self, line: str) -> None:
        value = table(self._value("/rr_gcode", {"gcode": line}))
        if value.get("err", 0) != 0:
            raise ServerError(f"{self.name} has not taken {line}: it is busy")

    def settings(self) -> str:
        """The settings keys of the object model, as M409 answers them."""
        lines = [{"key": key, "result": self._array(key)} for key in SETTINGS_ARRAYS]
        lines += [{"key": key, "result": self._model(key)} for key in SETTINGS_KEYS]
        return "\n".join(json.dumps(line) for line in lines)

    def close(self) -> None:
        """End the session, which frees its slot for others."""
        try:
            if self._connected:
                self.get("/rr_disconnect")
        except ServerError:
            pass
        finally:
            super().close()

    def _model(self, key: str) -> Any:
        return table(self._value("/rr_model", {"key": key, "flags": "d99vn"})).get("result")

    def _array(self, key: str) -> list[Any]:
        """A paged array of the object model."""
        entries: list[Any] = []
        flags = "d99vn"
        for _ in range(MOST_PAGES):
            page = table(self._value("/rr_model", {"key": key, "flags": flags}))
            entries += page["result"] if isinstance(page.get("result"), list) else []
            next_page = whole(page.get("next"))
            if not next_page:
                break
            flags = f"d99vna{next_page}"
        return entries

    def _value(self, path: str, params: Mapping[str, str]) -> Any:
        sentence = {503: f"{self.name} is short of memory just now: try again"}
        return self.check(self._get(path, params), "to answer", sentence)

    def _get(self, path: str, params: Mapping[str, str] | None = None) -> Reply:
        """The reply; an expired session is renewed."""
        reply = self.get(path, params)
        if reply.status == 401:
            self._connect()
            reply = self.get(path, params)
        return reply
