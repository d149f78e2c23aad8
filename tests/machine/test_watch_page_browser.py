"""The page of a running print in a real browser: its buttons pause, resume and stop the print of the terminal."""

import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.machine.browser import CHROMIUM, Browser
from tests.machine.running_workbench import PATIENCE_S

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: the page is not tried in a browser")

BEGIN, END = "G28\nM109 S200\nG1 Z0.2 F6000\n", "M104 S0\nM140 S0\n"
LIVE = "$('live').textContent"


@contextmanager
def printing(folder: Path) -> Iterator[tuple["subprocess.Popen[str]", str]]:
    """`print --watch` for over an hour on the simulated printer, and the address that it prints."""
    file = folder / "long.gcode"
    # A pause waits for the end of a stroke, so each stroke is short in time; in separate places they are drawn sooner.
    strokes = "".join(f"G1 X40 Y{k % 100} E{k + 1} F60\nG0 X10 F6000\n" for k in range(1000))
    file.write_text(BEGIN + strokes + END)
    options = ["--port", "sim", "--sim-speed", "200", "--watch", "--no-browser", "--force"]
    command = [sys.executable, "-m", "machine.cli.cli", "print", str(file), *options]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stderr is not None
        told = next(line for line in process.stderr if "watch the print at" in line)
        yield process, re.findall(r"http://\S+", told)[0]
    finally:
        process.kill()
        process.wait(PATIENCE_S)


def test_a_print_is_paused_resumed_and_stopped_by_buttons(browser: Browser, tmp_path: Path) -> None:
    with printing(tmp_path) as (process, address):
        browser.resize(400, 300)  # a small picture, because the print has many moves
        browser.open(address)
        browser.value("{ window.$ = (id) => document.getElementById(id); }")
        browser.wait(f"{LIVE}.startsWith('printing') && !$('orders').hidden")
        browser.click("[data-order=pause]")
        browser.wait(f"{LIVE}.startsWith('paused')")
        browser.click("[data-order=resume]")
        browser.wait(f"{LIVE}.startsWith('printing') && !document.querySelector('[data-order=pause]').hidden")
        browser.click("#cancel")
        browser.click("#go-on")
        browser.wait("!$('sure').matches(':popover-open')")
        browser.click("#cancel")
        browser.click("[data-order=cancel]")
        assert process.wait(PATIENCE_S) == 130
        assert browser.complaints == []


def test_an_emergency_stop_is_sent_once_and_the_print_ends(browser: Browser, tmp_path: Path) -> None:
    with printing(tmp_path) as (process, address):
        browser.resize(400, 300)  # a small picture, because the print has many moves
        browser.open(address)
        browser.wait("document.getElementById('live').textContent.startsWith('printing')")
        browser.click("#emergency")
        assert process.wait(PATIENCE_S) == 1
