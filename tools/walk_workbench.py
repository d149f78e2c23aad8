"""Walks through the workbench and counts: `python tools/walk_workbench.py MODEL [--pictures FOLDER]`; needs Chromium.

Every task of docs/workbench-tasks.md is done one after the other on a page by elements that are seen and can be pressed at that
moment. What a person has from earlier is there: work that was kept, and the printer of last time, the simulated one. Counted are
clicks: one for a button, a row, a field that is typed into, two for an entry of a drop-down list or a file. Told are, for each
task, its clicks and the seconds from the last of them to the answer. --pictures: one after each task.
--phone: instead, another device is paired on a page of a phone's size, and pauses a print of the model.
"""

import argparse
import json
import os
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from machine.printing.destination import Simulated
from machine.workbench.printing.prints import keep_printer
from tests.machine.browser import Browser
from tests.machine.prints import prints_line
from tests.machine.running_workbench import OpenToNetwork, open_workbench, workbench
from tests.machine.test_workbench_page import choose

IDLE = "document.documentElement.dataset.busy === ''"
SEARCHED = "!document.documentElement.hasAttribute('data-searching') && !document.body.classList.contains('no-cuts')"
PHASE = "document.documentElement.dataset.printing"
ROWS = "document.querySelectorAll('#parts-list tbody tr').length"
CHOSEN = "#parts-list tbody tr:last-child input[type=radio]"
WALLS, SUPPORT = '[data-key="process.walls"] input', '[data-key="process.support"] select'
SETTLED_S, KEPT_S, BAR_PIXELS = 0.8, 2.0, 42
PHONE = (390, 780)


def undone(step: str) -> str:
    """The condition that a step of this name is the last one."""
    return f"$('undo').ariaLabel === 'undo: {step}' && {IDLE}"


@dataclass(frozen=True)
class Task:
    """steps: `FIELD=VALUE` types, `FIELD~VALUE` chooses of a list, `facet` a place in the picture that it can rest on, `file`
    chooses the model, all else is pressed; until: a JavaScript condition."""

    name: str
    steps: tuple[str, ...]
    until: str = IDLE


TASKS = (
    Task("Open a model", ("file",), f"document.documentElement.dataset.shown && {IDLE}"),
    Task("Turn it by a quarter", ("[data-turn=x][data-deg='90']",), undone("turn the model")),
    Task("Lay a face down", ("#lay", "facet"), f"$('lay').ariaPressed === 'false' && {IDLE}"),
    Task("Stand it as is most promising", ("#resting button",)),
    Task("Scale it to 80 %", ("#scale=80",), f"$('scale').value === '80' && {IDLE}"),
    Task("Undo that", ("#undo",), f"$('scale').value === '100' && {IDLE}"),
    Task("Find how to cut it", ("#tab-parts", "#find"), f"{SEARCHED} && {IDLE}"),
    Task("Another number of parts", ("#front=first",), f"{ROWS} === 1 && {IDLE}"),
    Task("Cut by a plane", ("#add",), f"{ROWS} === 2 && {IDLE}"),
    Task("Move the plane where it cannot be", (CHOSEN, "#plane-offset=-50"), "$('put-near').checkVisibility()"),
    Task("The nearest place that works", ("#put-near",), f"$('problem').hidden && {IDLE}"),
    Task("Another material", ("#tab-settings", "#profiles [data-id=material] select~petg"), undone("take petg")),
    Task("Support off", ("#search-settings=supports", f"{SUPPORT}~none"), undone("set process.support")),
    Task("Settings of one part", ("#settings-part~2", "#search-settings=walls", f"{WALLS}=4")),
    Task("Pause before a layer", ("#tab-slices", "#stop-at=1:2", "#add-stop button"), "$('stops').querySelector('button')"),
    Task("Slice; time, plastic, price", ("#slice",), "!document.body.classList.contains('no-slices')"),
    Task("See the sliced parts", (), "document.documentElement.dataset.walls === '1 2'"),
    Task("Look at it move by move", ("#look",), "$('print-page').contentDocument?.documentElement?.dataset.state === 'ready'"),
    Task("Save the G-code", ("#save", "#save-gcode"), "true"),
    Task("Print it", ("#bar-print", "#begin"), f"{PHASE} === 'printing'"),
    Task("Stop at once", ("#emergency",), f"{PHASE} === 'over'"),
    Task("Preheat without a print", ("#hand", "[data-hand=heat]"), "/nozzle[0-9. ]+of/.test($('run-told').textContent)"),
    Task("Earlier work", ("#tab-model", "#kept-works button"), "$('undo').ariaLabel.startsWith('undo: open the work of')"),
)


class Hand:
    """Does what a person does to a page. clicks: how many of these since the task began."""

    def __init__(self, browser: Browser, model: Path) -> None:
        self._browser, self._model, self.clicks = browser, model, 0

    def do(self, step: str) -> None:
        """One step of a task. Raises TimeoutError where the element is not seen or cannot be pressed."""
        kind, element, value = parsed(step)
        self.clicks += 2 if kind in ("~", "file") else 1
        found = f"document.querySelector({json.dumps(element)})"
        if element:
            self._browser.wait(f"{found}?.checkVisibility() && !{found}.disabled")
        if kind == "file":
            choose(self._browser, self._model.name, self._model.read_bytes())
        elif kind == "facet":
            self._press_a_facet()
        elif kind:
            given = f"{found}.min" if value == "first" else json.dumps(value)
            events = "for (const kind of ['input', 'change']) field.dispatchEvent(new Event(kind, { bubbles: true }));"
            self._browser.value(f"{{ const field = {found}; field.value = {given}; {events} }}")
        else:
            self._browser.click(element)

    def _press_a_facet(self) -> None:
        """Somewhere among the lit faces, which a person sees and this does not."""
        width, height = self._browser.value("[$('canvas').clientWidth, $('canvas').clientHeight]")
        for k in range(400):
            self._browser.press(width * (0.3 + 0.4 * (k * 0.618 % 1)), height * (0.3 + 0.5 * (k / 400)) + BAR_PIXELS)
            if self._browser.value("$('lay').ariaPressed === 'false'"):
                return


def parsed(step: str) -> tuple[str, str, str]:
    """What is done (file, facet, =, ~; "": pressed), to which element, and the value."""
    if step in ("file", "facet"):
        return step, "", ""
    for kind in "~=":
        element, sign, value = step.rpartition(kind)
        if sign and "]" not in value:
            return kind, element, value
    return "", step, ""


def walk(browser: Browser, address: str, model: Path, at: Callable[[str, int, float], None]) -> None:
    """All tasks on an empty workbench; at: given the name, clicks and seconds of each when it is done."""
    browser.open(address)
    browser.wait("document.documentElement.dataset.line === 'open'")
    for task in TASKS:
        hand = Hand(browser, model)
        began = time.monotonic()
        for step in task.steps:
            began = time.monotonic()
            hand.do(step)
        browser.wait(task.until)
        at(task.name, hand.clicks, time.monotonic() - began)


def walk_from_the_phone(browser: Browser, model: Path, at: Callable[[str, int, float], None]) -> None:
    """A device is paired and pauses a print that another page has begun, on the simulated printer, sped up twenty times."""
    with open_workbench(str(model)) as running:
        begin_print(running)
        browser.resize(*PHONE, mobile=True)
        hand = Hand(browser, model)
        browser.value(f"location.assign({json.dumps(running.network)})")
        hand.clicks += 1  # the address that is typed
        for task, steps, until in (
            ("Pair a phone", (f"#code={running.code()}", "button"), "document.documentElement?.dataset.line === 'open'"),
            ("Pause from the phone", ("#tab-printing", "#take", "#pause"), f"{PHASE} === 'paused'"),
        ):
            for step in steps:
                began = time.monotonic()
                hand.do(step)
            browser.wait(until)
            at(task, hand.clicks, time.monotonic() - began)
            hand = Hand(browser, model)
        browser.click("#emergency")
        browser.wait(f"{PHASE} === 'over'")


def leave_earlier_work(model: Path) -> None:
    """What a person has done before: work on the model, which is kept, and the printer that was printed at."""
    keep_printer(Simulated())
    with workbench(str(model)) as running, running.line() as bench:
        bench.until(lambda state: state["model"])
        bench.do("turn", axis="z", deg=90)
        bench.until(lambda state: state["undo"] and not state["busy"])
        time.sleep(KEPT_S)


def begin_print(running: OpenToNetwork) -> None:
    """Has another page slice what lies on the bench and print it; it is there until the first layer is under way."""
    with running.line() as bench, prints_line(running, "computer") as prints:
        bench.until(lambda state: state["model"])
        bench.do("slice")
        bench.until(lambda state: state["sliced"])
        prints.do("check", port="sim", sim_speed=20)
        prints.until(lambda job: job["state"] == "ready")
        prints.command("begin")
        prints.until(lambda job: job["progress"].get("layer"))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model", type=Path)
    parser.add_argument("--pictures", type=Path, metavar="FOLDER", help="one that is there")
    parser.add_argument("--phone", action="store_true", help="pair a device and pause a print")
    given = parser.parse_args()
    with Browser((1280, 800)) as page, tempfile.TemporaryDirectory() as state:
        os.environ["XDG_STATE_HOME"] = state  # no printer of the person's own is printed at

        def told(name: str, clicks: int, seconds: float) -> None:
            print(f"{name:34}{clicks:3}{seconds:8.1f} s", flush=True)
            if given.pictures:
                time.sleep(SETTLED_S)
                page.screenshot(given.pictures / f"{name}.png")

        if given.phone:
            walk_from_the_phone(page, given.model, told)
        else:
            leave_earlier_work(given.model)
            with workbench() as running:
                walk(page, running.address, given.model, told)
        print(f"complaints: {page.complaints or 'none'}")
