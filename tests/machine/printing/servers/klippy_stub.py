"""A stub of Klipper's API server (docs/API_Server.md), complete enough for a real Moonraker to see a printer that is ready.

Requests are JSON ended by 0x03, on a Unix socket. A print reads its file at a steady rate; nothing moves.
"""

from __future__ import annotations

import asyncio
import json
import re
import threading
from pathlib import Path
from typing import Any

PRINT_S = 4.0  # duration of a print, whatever its file
TICK_S = 0.1
START = re.compile(r'SDCARD_PRINT_FILE FILENAME="(.+)"')


class KlippyStub:
    """`with KlippyStub(socket, gcodes) as klippy:` klippy.scripts are the G-code lines that it received."""

    def __init__(self, socket: Path, gcodes: Path) -> None:
        self.scripts: list[str] = []
        self._socket, self._gcodes = socket, gcodes
        self._state, self._message = "ready", "Printer is ready"
        self._job, self._file, self._position, self._size = "standby", "", 0, 0
        self._subscribed: dict[str, Any] = {}
        self._writers: list[asyncio.StreamWriter] = []
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_until_complete, args=(self._serve(),), daemon=True)
        self._over = asyncio.Event()

    def __enter__(self) -> KlippyStub:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._loop.call_soon_threadsafe(self._over.set)
        self._thread.join()

    async def _serve(self) -> None:
        server = await asyncio.start_unix_server(self._talk, str(self._socket))
        while not self._over.is_set():
            await asyncio.sleep(TICK_S)
            self._print()
        server.close()

    def _print(self) -> None:
        if self._job != "printing":
            return
        self._position = min(self._size, self._position + int(self._size * TICK_S / PRINT_S) + 1)
        if self._position == self._size:
            self._job = "complete"
        self._publish()

    def _publish(self) -> None:
        if not self._subscribed:
            return
        template = self._subscribed["response_template"]
        status = self._status(self._subscribed["objects"])
        self._send({**template, "params": {"status": status, "eventtime": self._loop.time()}})

    def _send(self, value: Any) -> None:
        for writer in self._writers:
            writer.write(json.dumps(value).encode() + b"\x03")

    async def _talk(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._writers.append(writer)
        while True:
            try:
                request = json.loads((await reader.readuntil(b"\x03"))[:-1])
            except (asyncio.IncompleteReadError, ConnectionError):
                self._writers.remove(writer)
                return
            try:
                answer = {"result": self._answer(request["method"], request.get("params", {}))}
            except ValueError as error:
                answer = {"error": {"error": "WebRequestError", "message": str(error)}}
            if request.get("id") is not None:
                writer.write(json.dumps({"id": request["id"], **answer}).encode() + b"\x03")

    def _answer(self, method: str, params: dict[str, Any]) -> Any:
        if method == "info":
            return {
                "state": self._state,
                "state_message": self._message,
                "software_version": "v0.13.0-stub",
                "klipper_path": "/klipper",
                "python_path": "/python",
                "hostname": "stub",
            }
        if method == "list_endpoints":
            orders = [f"pause_resume/{order}" for order in ("pause", "resume", "cancel")]
            return {"endpoints": ["info", "emergency_stop", "objects/list", "objects/query", "gcode/script", *orders]}
        if method == "objects/list":
            return {
                "objects": [
                    *self._every(),
                    "pause_resume",
                    "display_status",
                    "manual_stepper stepper_a",
                    "manual_stepper stepper_c",
                ]
            }
        if method in ("objects/query", "objects/subscribe"):
            if method == "objects/subscribe":
                self._subscribed = params
            return {"status": self._status(params["objects"]), "eventtime": self._loop.time()}
        if method == "emergency_stop":
            self._state, self._message, self._job = "shutdown", "Shutdown due to webhooks request", "error"
            self._publish()
        elif method == "gcode/script":
            self._execute(params["script"])
        elif method.startswith("pause_resume/"):
            self._job = {"pause": "paused", "resume": "printing", "cancel": "cancelled"}[method.rpartition("/")[2]]
            self._publish()
        return {}

    def _execute(self, script: str) -> None:
        start = START.fullmatch(script)
        if start is None:
            self.scripts.append(script)
            return
        if self._job == "printing":
            raise ValueError("SD busy")
        file = self._gcodes / start[1]
        if not file.is_file():
            raise ValueError("Unable to open file")
        self._job, self._file, self._position, self._size = "printing", start[1], 0, file.stat().st_size
        self._publish()

    def _every(self) -> dict[str, Any]:
        return {
            "webhooks": {"state": self._state, "state_message": self._message},
            "configfile": {"config": {"virtual_sdcard": {"path": str(self._gcodes)}}},
            "toolhead": {"axis_minimum": [-200.0, -200.0, -5.0, 0.0], "axis_maximum": [200.0, 200.0, 400.0, 0.0]},
            "print_stats": {"state": self._job, "filename": self._file, "total_duration": 1.5, "message": ""},
            "virtual_sdcard": {"file_position": self._position, "is_active": self._job == "printing"},
            "extruder": {"temperature": 209.6, "target": 210.0},
            "heater_bed": {"temperature": 59.9, "target": 60.0},
            "gcode_move": {"speed_factor": 1.0, "extrude_factor": 1.0},
        }

    def _status(self, wanted: dict[str, list[str] | None]) -> dict[str, Any]:
        every = self._every()
        return {
            name: {key: value for key, value in every[name].items() if keys is None or key in keys}
            for name, keys in wanted.items()
            if name in every
        }
