"""The workbench in Firefox: the same journey as in Chromium, shorter."""

from collections.abc import Iterator

import pytest

from mdp.save import stl
from tests.machine.firefox import FIREFOX, XVFB, Firefox
from tests.machine.test_workbench_page import FOUND, choose, saved
from tests.machine.workbench import Running
from tests.shapes import tee

VIEW = "$('print-page').contentDocument"
pytestmark = pytest.mark.skipif(FIREFOX is None, reason="Firefox is not installed: the workbench is not tried in it")


@pytest.fixture(scope="module")
def firefox(bench: Running) -> Iterator[Firefox]:
    with Firefox((900, 560)) as running:
        running.open(bench.address)
        running.wait("document.documentElement.dataset.line === 'open' && document.documentElement.dataset.busy === ''")
        choose(running, "tee.stl", stl(tee()))
        running.wait("document.documentElement.dataset.shown && $('title').textContent === 'tee.stl'")
        yield running


def test_firefox_draws_the_model_where_it_has_a_display(firefox: Firefox) -> None:
    drawn = "document.documentElement.dataset.state === 'ready'"
    assert firefox.value(drawn) is (XVFB is not None)
    assert "40.0 × 10.0 × 40.0 mm" in firefox.value("$('model-told').textContent")
    assert "mm²" in firefox.value("$('overhang').textContent")


def test_firefox_finds_parts_drags_a_plane_and_undoes_it(firefox: Firefox) -> None:
    firefox.click("#tab-parts")
    firefox.click("#find")
    firefox.wait(FOUND)
    assert "recommended" in firefox.value("$('front-told').textContent")
    firefox.click("#undo")
    firefox.wait("document.body.classList.contains('no-cuts')")
    firefox.click("[data-view=front]")
    firefox.click("#add")
    firefox.wait("!$('plane').hidden && $('plane-told').textContent")
    assert firefox.value("$('plane-offset').value") == "20.00"
    if XVFB is not None:
        firefox.wait("!$('handles').hidden")
        x, y = firefox.value(
            "(() => { const b = $('hand-along').getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; })()"
        )
        firefox.drag((x, y), (x, y - 20))
        firefox.wait("$('undo').getAttribute('aria-label') === 'undo: move a plane'")
        assert 20.0 < float(firefox.value("$('plane-offset').value")) < 35.0
    assert firefox.complaints == []


def test_firefox_changes_a_setting_slices_looks_and_prints(firefox: Firefox) -> None:
    firefox.click("#tab-settings")
    firefox.wait("document.querySelector('[data-key=\"process.walls\"] input')")
    firefox.value(
        "{ const input = document.querySelector('[data-key=\"process.walls\"] input');"
        "input.value = 1; input.dispatchEvent(new Event('change')); }"
    )
    firefox.wait("document.querySelector('[data-key=\"process.walls\"].changed')")
    firefox.click("#tab-slices")
    firefox.click("#slice")
    firefox.wait("!document.body.classList.contains('no-slices')")
    assert saved(firefox, "#save-gcode").startswith(";")
    firefox.click("#look")
    firefox.wait(f"{VIEW}?.documentElement?.dataset.state === '{'failed' if XVFB is None else 'ready'}'")
    assert firefox.value(f"{VIEW}.title").startswith("tee.stl")
    firefox.click("#leave-print")
    firefox.click("#tab-printing")
    firefox.click("#check")
    firefox.wait("!$('run-ask').hidden")
    firefox.click("#begin")
    firefox.wait("document.documentElement.dataset.printing === 'over'")
    assert firefox.value("$('run-state').textContent") == "the print is done"
    assert firefox.complaints == []
