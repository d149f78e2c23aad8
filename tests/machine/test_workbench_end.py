"""The whole workflow on one page: file, parts, a plane moved, one locked, slices, a print; and the same by the command line."""

import json
import shutil
from pathlib import Path

import pytest

from machine.cli.cli import main
from tests.machine.browser import CHROMIUM
from tests.machine.conftest import small_browser
from tests.machine.prints import commands_sent
from tests.machine.running_workbench import QUICK, workbench
from tests.machine.test_workbench_page import IDLE, choose, find_as_it_lies, saved
from tests.mdp.files import SHARED

KITTEN, FIGURE = SHARED / "models" / "kitten.off", Path(__file__).parents[2] / "mdp" / "demos" / "figure.ply"
PRINTING = "document.documentElement.dataset.printing"


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: the page is not tried in a browser")
def test_the_command_line_prints_the_same_from_the_plan_of_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    kitten = KITTEN.is_file()
    model, given = Path("kitten.off" if kitten else "figure.ply"), (*QUICK, "--set", f"process.scale={0.3 if kitten else 0.6}")
    shutil.copy(KITTEN if kitten else FIGURE, model)
    with workbench(*given) as bench, small_browser() as browser:
        browser.open(bench.address)
        browser.wait(f"document.documentElement.dataset.line === 'open' && {IDLE}")
        choose(browser, model.name, model.read_bytes())
        browser.wait(f"document.documentElement.dataset.shown && $('title').textContent === {json.dumps(model.name)} && {IDLE}")

        find_as_it_lies(browser)
        browser.wait("document.querySelectorAll('#parts-list input[type=radio]').length >= 2")
        browser.click("#parts-list input[type=checkbox]:not(:checked)")
        browser.wait("$('undo').getAttribute('aria-label').startsWith('undo: lock')")
        browser.click("#parts-list .card:last-child input[type=radio]")
        browser.wait("!$('plane').hidden && !$('handles').hidden")
        before = float(browser.value("$('plane-offset').value"))
        browser.value("$('hand-along').focus()")
        browser.key("ArrowUp")
        browser.wait("$('undo').getAttribute('aria-label') === 'undo: move a plane'")
        assert float(browser.value("$('plane-offset').value")) != before
        Path("plan.toml").write_text(saved(browser, "#save-plan"))

        browser.click("#tab-slices")
        browser.click("#slice")
        browser.wait("!document.body.classList.contains('no-slices')")
        browser.click("#tab-printing")
        browser.click("#check")
        browser.wait("!$('run-ask').hidden")
        browser.click("#begin")
        browser.wait(f"{PRINTING} === 'over'")
        assert browser.value("$('run-state').textContent") == "the print is done"
        log = Path(browser.value("$('run-files').querySelector('dd').textContent"))
        assert browser.complaints == []

    assert main(["print", str(model), *given, "--plan", "plan.toml", "--port", "sim", "--log", "own.log"]) == 0
    assert commands_sent(log) == commands_sent(Path("own.log"))
