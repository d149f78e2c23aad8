"""Browser: a headless Chromium driven by the DevTools protocol over a pipe, with the standard library only."""

import base64
import fcntl
import json
import os
import select
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from types import TracebackType
from typing import Any, Self

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FLAGS = [
    *("--headless", "--no-sandbox", "--no-first-run", "--hide-scrollbars", "--force-device-scale-factor=1"),
    *("--disable-quic", "--disable-background-networking", "--disable-component-update", "--disable-sync"),
    *("--disable-extensions", "--disable-dev-shm-usage", "--remote-debugging-pipe"),
    *("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"),  # WebGL2 without a graphics card
]
PLAIN = ("--disable-gpu-compositing",)  # the processor composes the page around the picture, in a third of the time
PATIENCE_S = 150.0  # starting it has taken 50 s on a busy machine
OWN_WORDS = "GPU stall due to ReadPixels"  # a warning about itself that Chromium prints when it is started with PLAIN
NAVIGATED = "Inspected target navigated or closed"  # the browser's answer when its page is left during a query


class Browser:
    """Headless Chromium with one page; a context manager that ends the process and removes its profile folder.

    density: pixels for each CSS pixel; 0.5 draws a quarter of the pixels, while positions and sizes in the page are unchanged.
    complaints: messages of the console and errors of the page; requests: every address requested since the last `open`.
    """

    def __init__(self, size: tuple[int, int] = (1280, 800), flags: tuple[str, ...] = (), density: float = 1.0) -> None:
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self._folder = tempfile.TemporaryDirectory(prefix="browser", ignore_cleanup_errors=True)
        self._count, self._read, self._session, self._density = 0, b"", "", density
        self._plain = set(PLAIN) <= set(flags)
        to_child, self._out = _pipe()
        self._in, from_child = _pipe()
        command = [str(CHROMIUM), *FLAGS, *flags, f"--user-data-dir={self._folder.name}", f"--window-size={size[0]},{size[1]}"]
        self._process = subprocess.Popen(
            [*command, "about:blank"],
            preexec_fn=lambda: _become(to_child, from_child),
            pass_fds=(3, 4),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(to_child)
        os.close(from_child)
        try:
            self._begin(size)
        except BaseException:
            self._end()
            raise

    def _begin(self, size: tuple[int, int]) -> None:
        """Attach to the first page, which may appear after the browser's first answer."""
        end_s = time.monotonic() + PATIENCE_S
        while not (pages := [t for t in self._send("Target.getTargets")["targetInfos"] if t["type"] == "page"]):
            if time.monotonic() > end_s:
                raise TimeoutError("the browser opens no page")
            time.sleep(0.02)
        self._session = self._send("Target.attachToTarget", targetId=pages[0]["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self._send(f"{domain}.enable")
        self.resize(*size)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._session = ""
        try:
            self._send("Browser.close")
            self._process.wait(PATIENCE_S)
        finally:
            self._end()

    def _end(self) -> None:
        """Remove the process, the pipe and the folder, whatever has happened."""
        self._process.kill()
        self._process.wait(PATIENCE_S)
        os.close(self._in)
        os.close(self._out)
        self._folder.cleanup()

    def open(self, address: str) -> None:
        """Load a page and wait until it reports that it is ready (or that it cannot draw)."""
        self.complaints.clear()
        self.requests.clear()
        self._send("Page.navigate", url=address)
        self.wait("['ready', 'failed'].includes(document.documentElement?.dataset.state)")

    def value(self, expression: str) -> Any:
        """The value of a JavaScript expression, awaited if it is a promise. Raises RuntimeError for an exception in it."""
        answer = self._send("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(json.dumps(answer["exceptionDetails"])[:800])
        return answer["result"].get("value")

    def wait(self, condition: str) -> None:
        """Wait until a JavaScript condition or its promise holds. Raises TimeoutError with the console's complaints."""
        end = time.monotonic() + PATIENCE_S
        while not self._holds(condition):
            if time.monotonic() > end:
                root = self.value("({...document.documentElement.dataset, title: document.title})")
                raise TimeoutError(f"{condition}; the page is {root}, the console says {self.complaints}")
            time.sleep(0.02)

    def _holds(self, condition: str) -> bool:
        """Whether a condition holds; False if the page is left for another one during the query."""
        try:
            return bool(self.value(f"Promise.resolve({condition}).then(Boolean)"))
        except RuntimeError as error:
            if NAVIGATED not in str(error):
                raise
            return False

    def click(self, selector: str) -> None:
        """Click an element by calling its `click()`."""
        self.value(f"document.querySelector({json.dumps(selector)}).click()")

    def middle(self, selector: str) -> tuple[float, float]:
        """The centre of an element in the window."""
        box = f"document.querySelector({json.dumps(selector)}).getBoundingClientRect()"
        x, y = self.value(f"(({{ x, y, width, height }}) => [x + width / 2, y + height / 2])({box})")
        return x, y

    def press(self, x: float, y: float) -> None:
        """A real mouse click at a point of the page."""
        for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
            self._send("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """A real drag with the left button."""
        places = [("mousePressed", start), ("mouseMoved", end), ("mouseReleased", end)]
        for kind, (x, y) in places:
            self._send("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)

    def hold(self, start: tuple[float, float], *ways: tuple[float, float]) -> None:
        """Press the left button at the first point and move it, still pressed, to the others."""
        for kind, (x, y) in (("mousePressed", start), *(("mouseMoved", way) for way in ways)):
            self._send("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)

    def release(self, point: tuple[float, float]) -> None:
        """Release the left button."""
        self._send("Input.dispatchMouseEvent", type="mouseReleased", x=point[0], y=point[1], button="left", clickCount=1)

    def touch(self, *moments: tuple[tuple[float, float], ...]) -> None:
        """Touch at the points of the first moment, move to those of the other moments, and lift the fingers."""
        for k, places in enumerate(moments):
            points = [{"x": x, "y": y, "id": finger} for finger, (x, y) in enumerate(places)]
            self._send("Input.dispatchTouchEvent", type="touchMove" if k else "touchStart", touchPoints=points)
        self._send("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def key(self, key: str) -> None:
        """Press and release a key."""
        text = {"text": key} if len(key) == 1 else {}
        self._send("Input.dispatchKeyEvent", type="keyDown", key=key, **text)
        self._send("Input.dispatchKeyEvent", type="keyUp", key=key)

    def resize(self, width: int, height: int, mobile: bool = False) -> None:
        """Resize the window, in CSS pixels."""
        given = {"width": width, "height": height, "deviceScaleFactor": self._density, "mobile": mobile}
        self._send("Emulation.setDeviceMetricsOverride", **given)

    def prefer(self, scheme: str) -> None:
        """Emulate the system's colour scheme: dark or light."""
        self._send("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])

    def screenshot(self, path: Path | None = None, scale: float = 1.0) -> bytes:
        """A PNG of the window; scale: size of the image as a fraction of the window's."""
        width, height = self.value("[innerWidth, innerHeight]")
        clip = {"x": 0, "y": 0, "width": width, "height": height, "scale": scale}
        given = {} if scale == 1.0 else {"clip": clip}
        picture = base64.b64decode(self._send("Page.captureScreenshot", format="png", **given)["data"])
        if path:
            path.write_bytes(picture)
        return picture

    def accessible(self) -> list[dict[str, str]]:
        """Role and name of everything that the page exposes to a screen reader."""
        nodes = self._send("Accessibility.getFullAXTree")["nodes"]
        shown = [node for node in nodes if not node["ignored"]]
        return [{"role": node["role"]["value"], "name": node.get("name", {}).get("value", "")} for node in shown]

    def pdf(self) -> bytes:
        """The page as a printed PDF."""
        return base64.b64decode(self._send("Page.printToPDF", printBackground=True)["data"])

    def _send(self, method: str, **given: Any) -> dict[str, Any]:
        self._count += 1
        message = {"id": self._count, "method": method, "params": given}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._out, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._receive()
            if answer.get("id") == self._count:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                result: dict[str, Any] = answer["result"]
                return result
            self._note(answer)

    def _receive(self) -> dict[str, Any]:
        while b"\0" not in self._read:
            if not select.select([self._in], [], [], PATIENCE_S)[0]:
                raise TimeoutError("the browser does not answer")
            piece = os.read(self._in, 1 << 20)
            if not piece:
                raise RuntimeError("the browser has ended")
            self._read += piece
        message, _, self._read = self._read.partition(b"\0")
        answer: dict[str, Any] = json.loads(message)
        return answer

    def _is_own(self, text: str) -> bool:
        """Whether a warning is due to the flags with which this browser was started."""
        return self._plain and OWN_WORDS in text

    def _note(self, event: dict[str, Any]) -> None:
        given = event.get("params", {})
        match event.get("method"):
            case "Network.requestWillBeSent":
                self.requests.append(given["request"]["url"])
            case "Runtime.exceptionThrown":
                self.complaints.append(json.dumps(given["exceptionDetails"])[:800])
            case "Runtime.consoleAPICalled" if given["type"] in ("error", "warning", "assert"):
                self.complaints.append(str([value.get("value") for value in given["args"]]))
            case "Log.entryAdded" if given["entry"]["level"] in ("error", "warning") and not self._is_own(given["entry"]["text"]):
                self.complaints.append(given["entry"]["text"])


def _become(to_child: int, from_child: int) -> None:
    """In the child process: move the pipe's ends to the descriptors that the browser expects."""
    os.dup2(to_child, 3)
    os.dup2(from_child, 4)


def _pipe() -> tuple[int, int]:
    """Move a pipe's ends away from descriptors 3 and 4, which the browser uses."""
    low = os.pipe()
    high = [fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 10) for end in low]
    for end in low:
        os.close(end)
    return high[0], high[1]
