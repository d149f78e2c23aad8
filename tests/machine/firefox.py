"""Firefox, driven by WebDriver BiDi: on a virtual display if Xvfb is installed, otherwise headless and without WebGL."""

import base64
import json
import os
import re
import shutil
import subprocess
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from websockets.sync.client import connect

FIREFOX = shutil.which("firefox-esr") or shutil.which("firefox")
XVFB = shutil.which("Xvfb")
PREFERENCES = {
    "remote.active-protocols": 1,  # WebDriver BiDi
    "webgl.force-enabled": True,  # also with software rendering
    "app.normandy.enabled": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "browser.shell.checkDefaultBrowser": False,
    "network.captive-portal-service.enabled": False,
}
PATIENCE_S = 150.0
KEYS = {"ArrowUp": "\ue013", "Escape": "\ue00c"}  # the names in WebDriver
ORIGIN = {"type": "pointer", "parameters": {"pointerType": "mouse"}, "id": "mouse"}


class Firefox:
    """Firefox with one page and the methods of `Browser` that the workbench's tests need; a context manager.

    downloads: the folder in which it saves files.
    """

    def __init__(self, size: tuple[int, int] = (1280, 800)) -> None:
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self._count, self._page = 0, ""
        self._folder = tempfile.TemporaryDirectory(prefix="browser", ignore_cleanup_errors=True)
        self.downloads = Path(self._folder.name, "downloads")
        self.downloads.mkdir()
        wanted = {**PREFERENCES, "browser.download.folderList": 2, "browser.download.dir": str(self.downloads)}
        lines = (f"user_pref({json.dumps(name)}, {json.dumps(value)});\n" for name, value in wanted.items())
        Path(self._folder.name, "user.js").write_text("".join(lines))
        self._display, shown = _display()
        self._left = ExitStack()
        flags = ["--remote-debugging-port", "0", "--no-remote", *([] if shown else ["--headless"])]
        with Path(self._folder.name, "told").open("wb") as log:
            self._process = subprocess.Popen(
                [str(FIREFOX), *flags, "--profile", self._folder.name, "about:blank"],
                env={**os.environ, **shown},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=log,
            )
        try:
            self._line = self._left.enter_context(connect(self._address() + "/session", max_size=None, proxy=None))
            self._begin(size)
        except BaseException:
            self._end()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._left.close()
        self._end()

    def open(self, address: str) -> None:
        """Load a page and wait until it reports that it is ready (or that it cannot draw)."""
        self.complaints.clear()
        self.requests.clear()
        self._send("browsingContext.navigate", context=self._page, url=address, wait="interactive")
        self.wait("['ready', 'failed'].includes(document.documentElement?.dataset.state)")

    def value(self, expression: str) -> Any:
        """The value of a JavaScript expression, awaited if it is a promise. Raises RuntimeError for an exception in it."""
        target = {"context": self._page}
        answer = self._send("script.evaluate", expression=expression, target=target, awaitPromise=True)
        if answer["type"] != "success":
            raise RuntimeError(json.dumps(answer["exceptionDetails"])[:800])
        return _plain(answer["result"])

    def wait(self, condition: str) -> None:
        """Wait until a JavaScript condition or its promise holds. Raises TimeoutError with the console's complaints."""
        end_s = time.monotonic() + PATIENCE_S
        while not self.value(f"Promise.resolve({condition}).then(Boolean)"):
            if time.monotonic() > end_s:
                raise TimeoutError(f"{condition}; the console says {self.complaints}")
            time.sleep(0.02)

    def click(self, selector: str) -> None:
        """Click an element by calling its `click()`."""
        self.value(f"document.querySelector({json.dumps(selector)}).click()")

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """A real drag with the left button."""
        places = [{"type": "pointerMove", "x": round(x), "y": round(y)} for x, y in (start, end)]
        button = [{"type": kind, "button": 0} for kind in ("pointerDown", "pointerUp")]
        actions = [places[0], button[0], places[1], button[1]]
        self._send("input.performActions", context=self._page, actions=[{**ORIGIN, "actions": actions}])

    def press(self, x: float, y: float) -> None:
        """A real mouse click at a point of the page."""
        self.drag((x, y), (x, y))

    def key(self, key: str) -> None:
        """Press and release a key: a letter, a digit or one of KEYS."""
        actions = [{"type": kind, "value": KEYS.get(key, key)} for kind in ("keyDown", "keyUp")]
        self._send("input.performActions", context=self._page, actions=[{"type": "key", "id": "keys", "actions": actions}])

    def resize(self, width: int, height: int) -> None:
        """Resize the window, in CSS pixels."""
        self._send("browsingContext.setViewport", context=self._page, viewport={"width": width, "height": height})

    def screenshot(self, path: Path | None = None) -> bytes:
        """A PNG of the window."""
        picture = base64.b64decode(self._send("browsingContext.captureScreenshot", context=self._page)["data"])
        if path:
            path.write_bytes(picture)
        return picture

    def _address(self) -> str:
        log, end_s = Path(self._folder.name, "told"), time.monotonic() + PATIENCE_S
        while not (address := re.search(r"WebDriver BiDi listening on (ws://\S+)", log.read_text(errors="replace"))):
            if time.monotonic() > end_s or self._process.poll() is not None:
                raise RuntimeError(f"Firefox does not begin: {log.read_text(errors='replace')[-800:]}")
            time.sleep(0.02)
        return address[1]

    def _begin(self, size: tuple[int, int]) -> None:
        self._send("session.new", capabilities={})
        self._page = self._send("browsingContext.getTree")["contexts"][0]["context"]
        self._send("session.subscribe", events=["log.entryAdded", "network.beforeRequestSent"])
        self.resize(*size)

    def _end(self) -> None:
        """End the process and remove the folder, whatever has happened."""
        for process in (self._process, self._display):
            if process is not None:
                process.kill()
                process.wait(PATIENCE_S)
        self._folder.cleanup()

    def _send(self, method: str, **given: Any) -> dict[str, Any]:
        self._count += 1
        self._line.send(json.dumps({"id": self._count, "method": method, "params": given}))
        while True:
            answer = json.loads(self._line.recv(PATIENCE_S))
            if answer.get("id") == self._count:
                if answer["type"] == "error":
                    raise RuntimeError(f"{method}: {answer['error']}: {answer['message']}")
                result: dict[str, Any] = answer["result"]
                return result
            self._note(answer)

    def _note(self, event: dict[str, Any]) -> None:
        given = event.get("params", {})
        match event.get("method"):
            case "network.beforeRequestSent":
                self.requests.append(given["request"]["url"])
            case "log.entryAdded" if given["level"] in ("error", "warn"):
                self.complaints.append(str(given["text"]))


def _display() -> tuple["subprocess.Popen[bytes] | None", dict[str, str]]:
    """A virtual display, with the environment that names it; None if Xvfb is not installed."""
    if XVFB is None:
        return None, {}
    read, write = os.pipe()
    command = [XVFB, "-displayfd", str(write), "-screen", "0", "1400x1000x24", "-nolisten", "tcp"]
    process = subprocess.Popen(command, pass_fds=(write,), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    os.close(write)
    with os.fdopen(read) as number:
        shown = f":{number.readline().strip()}"
    return process, {"DISPLAY": shown, "LIBGL_ALWAYS_SOFTWARE": "1", "MOZ_ENABLE_WAYLAND": "0"}


def _plain(value: dict[str, Any]) -> Any:
    """A Python value from its BiDi representation."""
    match value["type"]:
        case "array":
            return [_plain(entry) for entry in value["value"]]
        case "object":
            return {key: _plain(entry) for key, entry in value["value"]}
        case _:
            return value.get("value")
