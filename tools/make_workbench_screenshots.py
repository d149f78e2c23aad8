"""Makes pictures of the workbench: `python tools/make_workbench_screenshots.py [FOLDER]`; needs Chromium.

Without a folder those of the docs, `workbench.png`, `workbench-phone.png` and the small ones of one session, `strip/`; with one,
every step of the way from model to print, on a desktop and on a phone, light and dark, to be looked at.
"""

import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from tests.machine.browser import Browser
from tests.machine.running_workbench import workbench

DOCS = Path(__file__).resolve().parents[1] / "docs"
DEMO = "demo:tree"
DESKTOP, PHONE = (1280, 800), (390, 844)
STRIP = ("model", "parts", "plane", "settings", "sliced", "look", "checks", "printing")
STRIP_SIZE, STRIP_SCALE = (1040, 650), 0.5
SETTLED_S = 0.8
IDLE = "document.documentElement.dataset.busy === ''"
FOUND = "!document.documentElement.hasAttribute('data-searching') && !document.body.classList.contains('no-cuts')"
SLICED = "!document.body.classList.contains('no-slices')"


@dataclass(frozen=True)
class Step:
    """What is done on the page before its picture is taken, and until when."""

    name: str
    clicks: tuple[str, ...] = ()
    until: str = "true"


STEPS = (
    Step("model"),
    Step("finding", ("#tab-parts", "#find"), "document.documentElement.hasAttribute('data-searching')"),
    Step("parts", (), FOUND),
    Step("plane", ("#parts-list tbody tr:last-child input",), "!document.getElementById('plane').hidden"),
    Step("settings", ("#tab-settings",), "document.querySelectorAll('[data-key]').length > 10"),
    Step("slicing", ("#tab-slices", "#slice"), "document.getElementById('slice').disabled"),
    Step("sliced", (), SLICED),
    Step("look", ("#look",), "!document.getElementById('print-page').hidden"),
    Step("checks", ("#look", "#tab-printing", "#check"), "!document.getElementById('run-ask').hidden"),
    Step("printing", ("#begin",), "document.documentElement.dataset.printing === 'printing'"),
)


def walk(browser: Browser, address: str, steps: tuple[Step, ...], keep: Callable[[str], None]) -> None:
    """The steps one after the other on a workbench on which a model lies; keep: given the name of each when it is there."""
    browser.open(address)
    browser.wait(f"document.documentElement.dataset.shown && {IDLE}")
    for step in steps:
        for element in step.clicks:
            browser.click(element)
        browser.wait(step.until)
        time.sleep(SETTLED_S)
        keep(step.name)
    print(f"complaints: {browser.complaints or 'none'}")


def picture(path: Path, size: tuple[int, int], last: str) -> None:
    """The picture of the step of a name."""
    names = [step.name for step in STEPS]
    with workbench(DEMO) as running, Browser(size) as browser:
        browser.resize(*size, mobile=size == PHONE)
        browser.prefer("light")

        def keep(name: str) -> None:
            if name == last:
                browser.screenshot(path)

        walk(browser, running.address, STEPS[: names.index(last) + 1], keep)


def strip(folder: Path) -> None:
    """One session in small pictures."""
    folder.mkdir(exist_ok=True)
    with workbench(DEMO) as running, Browser(STRIP_SIZE) as browser:
        browser.prefer("light")

        def keep(name: str) -> None:
            browser.value("$('run-files').hidden = true")  # a log has another path each time
            if name in STRIP:
                browser.screenshot(folder / f"{STRIP.index(name) + 1}-{name}.png", STRIP_SCALE)

        walk(browser, running.address, STEPS, keep)


def every(folder: Path) -> None:
    """All steps on both, light and dark."""
    folder.mkdir(parents=True, exist_ok=True)
    for device, size in (("desktop", DESKTOP), ("phone", PHONE)):
        with workbench(DEMO) as running, Browser(size) as browser:
            browser.resize(*size, mobile=size == PHONE)

            def keep(name: str, device: str = device, browser: Browser = browser) -> None:
                for scheme in ("light", "dark"):
                    browser.prefer(scheme)
                    time.sleep(SETTLED_S)
                    browser.screenshot(folder / f"{device}-{name}-{scheme}.png")

            walk(browser, running.address, STEPS, keep)


@contextmanager
def without_earlier_work() -> Iterator[None]:
    """What was kept of other pictures' work is not offered."""
    with tempfile.TemporaryDirectory() as state:
        os.environ["XDG_STATE_HOME"] = state
        yield


if __name__ == "__main__":
    if len(sys.argv) > 1:
        with without_earlier_work():
            every(Path(sys.argv[1]))
    else:
        for name, size, step in (("workbench.png", DESKTOP, "plane"), ("workbench-phone.png", PHONE, "parts")):
            with without_earlier_work():
                picture(DOCS / name, size, step)
        with without_earlier_work():
            strip(DOCS / "strip")
