"""A G-code file dropped on the workbench: shown with the findings of its dry run, and printed with the checks of `print`."""

import json
from pathlib import Path

import pytest

from mdp.save import stl
from tests.machine.browser import CHROMIUM, Browser
from tests.machine.conftest import small_browser
from tests.machine.prints import commands_sent, prints_line
from tests.machine.running_workbench import QUICK, Running, workbench
from tests.machine.test_workbench_page import choose
from tests.shapes import box

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: the page is not tried in a browser")

VIEW = "$('print-page').contentDocument"
GOOD = "G21\nG90\nM83\nG28\nM104 S210\nM109 S210\nG1 Z0.3 F600\nG1 X10 E1 F600\nG1 Y10 E1\nG0 Z20\nM104 S0\nM140 S0\n"


def opened(browser: Browser, running: Running, name: str, content: str) -> None:
    """Drop a file on the page of an empty bench and wait for its page."""
    browser.open(running.address)
    browser.wait("document.documentElement.dataset.version")
    choose(browser, name, content.encode())
    browser.wait(f"!$('gcode-line').hidden && $('gcode-told').textContent.startsWith({json.dumps(name)})")
    browser.wait(f"['ready', 'failed'].includes({VIEW}?.documentElement?.dataset.state) && !$('print-page').hidden")


def test_a_dropped_file_is_shown_and_printed_unchanged(tmp_path: Path) -> None:
    with workbench(*QUICK) as running, small_browser() as browser, prints_line(running, "watching") as page:
        opened(browser, running, "box.gcode", GOOD)
        assert browser.value(f"{VIEW}.getElementById('title').textContent") == "box.gcode"
        assert browser.value("[$('title').textContent, document.title]") == ["box.gcode", "box.gcode – tiltprint"]
        assert "Ready to print" in browser.value("$('gcode-told').textContent")
        choose(browser, "second.gcode", GOOD.replace("X10", "X12").encode())
        browser.wait(f"{VIEW}?.getElementById('title')?.textContent === 'second.gcode'")
        choose(browser, "box.gcode", GOOD.encode())
        browser.wait(f"{VIEW}?.getElementById('title')?.textContent === 'box.gcode'")
        browser.click("#check")
        browser.wait("!$('run-ask').hidden")
        assert browser.value("$('run-title').textContent") == "box.gcode on the simulated printer"
        browser.click("#begin")
        done = page.until(lambda seen: seen["is_over"])
        assert done["sentence"] == "the print is done"
        assert set(GOOD.splitlines()) - {"M83"} <= set(commands_sent(Path(done["log"])))
        browser.click("[data-do=close_gcode]")
        browser.wait("$('gcode-line').hidden && $('print-page').hidden && $('check').disabled")
        assert browser.complaints == []


def test_a_dropped_file_with_errors_shows_them_and_is_refused_like_print(tmp_path: Path) -> None:
    with workbench(*QUICK) as running, small_browser() as browser:
        opened(browser, running, "far.gcode", GOOD.replace("X10", "X5000"))
        assert "problem" in browser.value("$('gcode-told').textContent")
        browser.click("#leave-print")
        assert browser.value("document.activeElement.id") == "tab-printing"
        browser.click("#check")
        browser.wait("!$('print-problem').hidden && !$('force-line').hidden")
        assert "5000" in browser.value("$('print-problem').textContent")


def test_a_model_that_is_opened_closes_the_g_code_file(tmp_path: Path) -> None:
    (tmp_path / "box.gcode").write_text(GOOD)
    (tmp_path / "box.stl").write_bytes(stl(box(8, 8, 8)))
    with workbench(*QUICK) as running, running.line() as page:
        running.send(tmp_path / "box.gcode")
        page.until(lambda state: state["gcode"])
        running.send(tmp_path / "box.stl")
        page.until(lambda state: state["model"] and state["gcode"] is None)


def test_a_file_of_another_kind_is_refused_with_the_kinds_that_can_be_opened(tmp_path: Path) -> None:
    (tmp_path / "photo.jpg").write_bytes(b"JFIF")
    with workbench(*QUICK) as running:
        status, text = running.send(tmp_path / "photo.jpg")
        assert status == 422
        assert all(kind in text for kind in (b"photo.jpg: models (.stl", b"G-code (", b".gcode", b"plans and profiles (.toml)"))


def test_a_file_without_moves_is_refused_with_its_name(tmp_path: Path) -> None:
    (tmp_path / "empty.gcode").write_text("M104 S0\n")
    with workbench(*QUICK) as running:
        status, text = running.send(tmp_path / "empty.gcode")
        assert (status, b"empty.gcode holds no move: there is nothing to show" in text) == (422, True)


def test_a_file_without_a_machine_is_dry_run_for_that_of_the_settings(tmp_path: Path) -> None:
    (tmp_path / "box.gcode").write_text(GOOD)
    with workbench(*QUICK) as running, running.line() as page:
        running.send(tmp_path / "box.gcode")
        page.until(lambda state: state["gcode"])
        assert "the file does not name its machine, so it was tried for generic A/C table as" in page.state["gcode"]["told"]
