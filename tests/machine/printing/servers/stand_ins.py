"""Stand-ins for print servers, in this process, that are as strict about their protocols as the real ones."""

from __future__ import annotations

import hashlib
import json
import re
import ssl
import sys
import threading
import zlib
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl, urlsplit

from machine.printing.destination import parse_server_address
from machine.printing.servers.http import Tell
from machine.printing.servers.server import PrintServer
from machine.printing.servers.servers import open_server

KEY = "workshop-key-0815"


class Job:
    """A server's files and its print, which advances at each query. asked: all requests in order."""

    def __init__(self) -> None:
        self.files: dict[str, bytes] = {}
        self.asked: list[str] = []
        self.state, self.file, self.position = "idle", "", 0
        self.steps = 4  # queries until a print is done
        self.commands: list[str] = []
        self.halted = False
        self.up_s = 3600  # uptime in seconds
        self.refuse: dict[str, tuple[int, str]] = {}  # path -> status and text of the answer instead
        self.break_off: str = ""  # path during whose body the server breaks off

    def start(self, file: str) -> None:
        self.state, self.file, self.position = "printing", file, 0

    def restart(self) -> None:
        """Restart after a crash, without the print."""
        self.state, self.file, self.position, self.up_s = "idle", "", 0, 5

    def look(self) -> None:
        if self.state == "printing":
            size = len(self.files[self.file])
            self.position = min(self.position + size // self.steps + 1, size)
            if self.position == size:
                self.state = "complete"


class Handler(BaseHTTPRequestHandler):
    """One request. Subclasses have answer(method, path, query, body) -> status and value."""

    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True
    job: Job
    key: str

    def answer(self, method: str, path: str, query: dict[str, str], body: bytes) -> tuple[int, Any]:
        raise NotImplementedError

    def do_GET(self) -> None:
        self._serve("GET")

    def do_POST(self) -> None:
        self._serve("POST")

    def log_message(self, format: str, *args: object) -> None:
        pass

    def _serve(self, method: str) -> None:
        parts = urlsplit(self.path)
        if parts.path == self.job.break_off:
            self.rfile.read(1000)
            self.connection.close()
            return
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        self.job.asked.append(f"{method} {parts.path}")
        status, value = self.job.refuse.get(parts.path) or self.answer(method, parts.path, dict(parse_qsl(parts.query)), body)
        text = value if isinstance(value, bytes) else json.dumps(value).encode()
        self.send_response(status)
        if 300 <= status < 400:
            self.send_header("Location", str(value))
        self.send_header("Content-Length", str(0 if status == 204 else len(text)))
        self.end_headers()
        if status != 204:
            self.wfile.write(text)

    def form(self, body: bytes) -> dict[str, tuple[str, bytes]]:
        """Name -> file name and content, of a multipart form, which must be complete."""
        boundary = re.fullmatch(r"multipart/form-data; boundary=(\S+)", self.headers["Content-Type"])
        assert boundary is not None
        mark = b"--" + boundary[1].encode()
        first, *parts, last = body.split(mark)
        assert (first, last) == (b"", b"--\r\n")
        fields = {}
        for part in parts:
            head, _, content = part.removeprefix(b"\r\n").partition(b"\r\n\r\n")
            disposition = re.search(rb'form-data; name="([^"]*)"(?:; filename="([^"]*)")?', head)
            assert disposition is not None
            assert content.endswith(b"\r\n")
            fields[disposition[1].decode()] = ((disposition[2] or b"").decode(), content[:-2])
        return fields


class OctoPrintStandIn(Handler):
    """OctoPrint 1.11.8, as in octoprint/server/api."""

    def answer(self, method: str, path: str, query: dict[str, str], body: bytes) -> tuple[int, Any]:
        job = self.job
        if self.headers.get("X-Api-Key") != self.key:
            return 403, {"error": "You don't have the permission to access the requested resource."}
        if path == "/api/version":
            return 200, {"api": "0.1", "server": "1.11.8", "text": "OctoPrint 1.11.8"}
        if path == "/api/files/local" and method == "POST":
            name, content = self.form(body)["file"]
            if job.state in ("printing", "paused") and job.file == name:
                return 409, {"error": "Trying to overwrite file that is currently being printed"}
            job.files[name] = content
            return 201, {"done": True, "files": {"local": {"name": name, "path": name}}}
        if path.startswith("/api/files/local/"):
            return self._file(path.rpartition("/")[2], method, body)
        if path == "/api/printer":
            flags = {"operational": True, "printing": job.state == "printing", "paused": job.state == "paused"}
            heat = {"tool0": {"actual": 209.6, "target": 210.0}, "bed": {"actual": 59.9, "target": 60.0}}
            return (
                (409, {"error": "Printer is not operational"})
                if job.halted
                else (200, {"state": {"flags": flags}, "temperature": heat})
            )
        if path == "/api/printer/command":
            line = json.loads(body)["command"]
            job.commands.append(line)
            job.halted = job.halted or line == "M112"
            return 204, None
        return self._job(method, body) if path == "/api/job" else (404, {"error": "Not Found"})

    def _file(self, name: str, method: str, body: bytes) -> tuple[int, Any]:
        if name not in self.job.files:
            return 404, {"error": "Not Found"}
        if method == "GET":
            return 200, {"name": name}
        assert json.loads(body) == {"command": "select", "print": True}
        if self.job.state in ("printing", "paused"):
            return 409, {"error": "Printer is already printing, cannot select a new file"}
        self.job.start(name)
        return 204, None

    def _job(self, method: str, body: bytes) -> tuple[int, Any]:
        job = self.job
        if method == "GET":
            job.look()
            done = 100.0 if job.state == "complete" else 100.0 * job.position / max(1, len(job.files.get(job.file, b"")))
            progress = {"completion": done if job.file else None, "filepos": job.position, "printTime": 12}
            return 200, {"job": {"file": {"path": job.file or None}}, "progress": progress, "state": "Operational"}
        if job.state not in ("printing", "paused"):
            return 409, {"error": "Printer is neither printing nor paused"}
        order = json.loads(body)
        job.state = {"cancel": "cancelled", "pause": "paused", "resume": "printing"}[order.get("action", order["command"])]
        return 204, None


BUILT_IN = (
    *("G1", "M104", "MANUAL_STEPPER", "SET_VELOCITY_LIMIT", "SET_HEATER_TEMPERATURE", "TEMPERATURE_WAIT", "TURN_OFF_HEATERS"),
    *("SET_PRESSURE_ADVANCE", "PAUSE", "RESUME", "CANCEL_PRINT"),
)


class MoonrakerStandIn(Handler):
    """Moonraker 0.11 with a Klipper that is ready. scans: whether it has read the files that it stores."""

    steppers = ("stepper_a", "stepper_c")
    macros = ("HOME_AB",)
    scans = True

    def answer(self, method: str, path: str, query: dict[str, str], body: bytes) -> tuple[int, Any]:
        if self.headers.get("X-Api-Key") != self.key:
            return 401, {"error": {"code": 401, "message": "Unauthorized"}}
        value = json.loads(body) if body.startswith(b"{") else {}
        if path == "/server/files/upload":
            return self._upload(body)
        if path == "/server/files/metadata":
            known = self.scans and query["filename"] in self.job.files
            return (200, {"result": {}}) if known else (404, {"error": {"code": 404, "message": "Metadata not available"}})
        if path == "/server/files/directory":
            assert query["path"] == "gcodes"
            return 200, {"result": {"dirs": [{"dirname": ".cache"}], "files": [{"filename": name} for name in self.job.files]}}
        if path.startswith("/printer/"):
            return self._printer(path, value)
        if path == "/server/info":
            state = "shutdown" if self.job.halted else "ready"
            return 200, {"result": {"klippy_connected": True, "klippy_state": state, "moonraker_version": "v0.11.0"}}
        return 404, {"error": {"code": 404, "message": "Not Found"}}

    def _upload(self, body: bytes) -> tuple[int, Any]:
        form = self.form(body)
        name, content = form["file"]
        if self.job.state in ("printing", "paused") and self.job.file == name:
            return 403, {"error": {"code": 403, "message": "File is loaded, upload not permitted"}}
        if form["checksum"][1].decode() != hashlib.sha256(content).hexdigest():
            return 422, {"error": {"code": 422, "message": "File checksum mismatch"}}
        self.job.files[name] = content
        return 201, {"item": {"root": "gcodes", "path": name}, "print_started": False, "print_queued": False}

    def _printer(self, path: str, value: dict[str, Any]) -> tuple[int, Any]:
        job = self.job
        if path == "/printer/info":
            return 200, {
                "result": {"state": "ready", "software_version": "v0.13.0-1", "state_message": "Shutdown due to webhooks request"}
            }
        if path == "/printer/objects/list":
            return 200, {"result": {"objects": ["gcode", "toolhead", *(f"manual_stepper {name}" for name in self.steppers)]}}
        if path == "/printer/objects/query":
            return 200, {"result": {"status": self._objects(value["objects"])}}
        if path == "/printer/emergency_stop":
            job.halted = True
        elif path == "/printer/gcode/script":
            job.commands.append(value["script"])
        elif path == "/printer/print/start":
            if job.state in ("printing", "paused"):
                return 400, {"error": {"code": 400, "message": "SD busy"}}
            job.start(value["filename"])
        else:
            orders = {"pause": "paused", "resume": "printing", "cancel": "cancelled"}
            job.state = orders[path.rpartition("/")[2]]
        return 200, {"result": "ok"}

    def _objects(self, names: dict[str, None]) -> dict[str, Any]:
        job = self.job
        job.look()
        state = "standby" if job.state == "idle" else job.state
        every = {
            "gcode": {"commands": {name: {} for name in (*BUILT_IN, *self.macros)}},
            "toolhead": {"axis_minimum": [-200.0, -200.0, -5.0, 0.0], "axis_maximum": [200.0, 200.0, 400.0, 0.0]},
            "print_stats": {"state": state, "filename": job.file, "total_duration": 12.5, "message": ""},
            "virtual_sdcard": {"file_position": job.position},
            "extruder": {"temperature": 209.6, "target": 210.0},
            "heater_bed": {"temperature": 59.9, "target": 60.0},
            "gcode_move": {"speed_factor": 1.0, "extrude_factor": 1.0},
        }
        return {name: every[name] for name in names if name in every}


class DuetStandIn(Handler):
    """RepRapFirmware 3.5, as in its HttpResponder: a session by its key, upper-case escapes, a CRC, M0 only while paused."""

    sessions: set[str]

    def answer(self, method: str, path: str, query: dict[str, str], body: bytes) -> tuple[int, Any]:
        if path == "/rr_connect" and "password" in query:
            if query["password"] != self.key:
                return 200, {"err": 1}
            assert query["sessionKey"] == "yes"
            self.sessions.add("4711")
            return 200, {"err": 0, "sessionTimeout": 8000, "boardType": "duet3mb6hc", "sessionKey": 4711}
        if self.headers.get("X-Session-Key") not in self.sessions:
            return (401, b"<html>") if method == "GET" else (500, b"<html>")
        if method == "POST":
            assert path == "/rr_upload"
            return self._upload(query, body)
        return self._get(path, query)

    def _upload(self, query: dict[str, str], body: bytes) -> tuple[int, Any]:
        if query["crc32"] != f"{zlib.crc32(body):08x}":
            return 200, {"err": 1}
        self.job.files[query["name"].removeprefix("0:/gcodes/")] = body
        return 200, {"err": 0}

    def _get(self, path: str, query: dict[str, str]) -> tuple[int, Any]:
        if path == "/rr_disconnect":
            self.sessions.clear()
            return 200, {"err": 0}
        if path == "/rr_reply":
            return 200, b""
        if path == "/rr_fileinfo":
            return 200, {"err": 0 if query["name"].removeprefix("0:/gcodes/") in self.job.files else 1}
        if path == "/rr_gcode":
            self._execute(query["gcode"])
            return 200, {"buff": 240}
        if path == "/rr_model":
            return 200, {
                "key": query.get("key", ""),
                "flags": query["flags"],
                "result": self._model(query.get("key", "")),
                "next": 0,
            }
        return 500, b"<html>"

    def _execute(self, line: str) -> None:
        job = self.job
        if started := re.fullmatch(r'M32 "0:/gcodes/(.+)"', line):
            job.start(started[1])
        elif line == "M25" and job.state == "printing":
            job.state = "paused"
        elif line == "M24" and job.state == "paused":
            job.state = "printing"
        elif line == "M0" and job.state == "paused":
            job.state = "cancelled"
        else:
            job.commands.append(line)
            job.halted = job.halted or line == "M112"

    def _model(self, key: str) -> Any:
        job = self.job
        if key == "boards[0]":
            return {"firmwareName": "RepRapFirmware for Duet 3 MB6HC", "firmwareVersion": "3.5.4"}
        if key == "move.axes":
            return [{"letter": letter, "min": -200.0, "max": 300.0} for letter in "XYZ"] + [
                {"letter": "A", "min": -95.0, "max": 95.0},
                {"letter": "C", "min": -36000.0, "max": 36000.0},
            ]
        if key == "tools":
            return [{"heaters": [1]}]
        if key == "heat":
            return {"bedHeaters": [0]}
        if key == "job.file.fileName":
            return f"0:/gcodes/{job.file}" if job.file else None
        job.look()
        states = {"printing": "processing", "paused": "paused"}
        status = "halted" if job.halted else states.get(job.state, "idle")
        heaters = [{"current": 59.9, "active": 60.0}, {"current": 209.6, "active": 210.0}]
        duration = 12 if status in ("processing", "paused") else None
        return {
            "state": {"status": status, "upTime": job.up_s},
            "job": {"filePosition": job.position, "duration": duration},
            "heat": {"heaters": heaters},
        }


STAND_INS: dict[str, type[Handler]] = {"octoprint": OctoPrintStandIn, "moonraker": MoonrakerStandIn, "duet": DuetStandIn}


class _Server(ThreadingHTTPServer):
    daemon_threads = True

    def handle_error(self, request: object, client_address: object) -> None:
        """Ignore clients that hang up."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


@contextmanager
def stand_in(
    kind: str, key: str = KEY, certificate: Path | None = None, handler: type[Handler] | None = None, **more: Any
) -> Iterator[tuple[Job, str]]:
    """A print server of a kind: its job and its address. certificate: a PEM file with its key, for TLS."""
    job = Job()
    bound = type(kind, (handler or STAND_INS[kind],), {"job": job, "key": key, "sessions": set(), **more})
    server = _Server(("127.0.0.1", 0), bound)
    if certificate is not None:
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(certificate)
        server.socket = context.wrap_socket(server.socket, server_side=True)
    threading.Thread(target=lambda: server.serve_forever(0.02), daemon=True).start()
    scheme = "http" if certificate is None else "https"
    try:
        yield job, f"{kind}:{scheme}://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        server.server_close()


def session_with(address: str, tell: Tell | None = None) -> AbstractContextManager[PrintServer]:
    """A session with the server of an address. tell: receives every line exchanged."""
    return open_server(parse_server_address(address), tell)
