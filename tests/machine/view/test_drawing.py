"""Drawing in a browser: a coarse picture first, progress, resized panels, linked sliders."""

from functools import cache
from pathlib import Path

import pytest

from machine.dryrun.dryrun import dry_run
from machine.program import Program
from machine.view.page import TEMPLATE, bundle, print_page
from profiles.profile import load
from tests.machine.browser import CHROMIUM, Browser
from tests.machine.test_browser import FOREIGN, PICTURE, opened, program, put, row

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: the page is not tried in a browser")

IDLE = "document.documentElement.dataset.picture === 'idle'"
RESIZED_AFTER = """((frames) => {
  const real = window.requestAnimationFrame;
  window.requestAnimationFrame = (act) => real((now) => {
    const width = 300 + Math.round(90 * Math.random());
    if (frames-- === 0) document.querySelector('main').style.gridTemplateColumns = `minmax(0, 1fr) ${width}px`;
    act(now);
  });
  document.getElementById('position').dispatchEvent(new Event('input'));
  setTimeout(() => { window.requestAnimationFrame = real; }, 1000);
})"""
# Moves the slider during every piece of a picture, and records the notices.
SLID_WHILE_DRAWN = """(() => {
  const root = document.documentElement, [slider, notice] = ['position', 'notice'].map((id) => document.getElementById(id));
  const ends = [slider.max, 3000];
  window.said = [];
  let moves = 0;
  new MutationObserver(() => said.push(notice.textContent)).observe(notice, { childList: true });
  new MutationObserver(() => {
    if (root.dataset.picture !== 'drawing' || moves > 12) return;
    slider.value = ends[++moves % 2];
    slider.dispatchEvent(new Event('input'));
  }).observe(root, { attributeFilter: ['data-picture'] });
  slider.dispatchEvent(new Event('input'));
})()"""


@cache
def long_print(rows: int = 6000) -> bytes:
    """The viewer page of a file of many short strokes."""
    strokes = [f"G1 X{k % 40} Y{k // 1000 % 30 + k % 2} E{10 + k * 0.01:.2f} F1200" for k in range(rows)]
    profile, lines = load(), (*FOREIGN.splitlines(), *strokes)
    return print_page("long.gcode", Program(lines, dry_run(lines, profile), None), profile, known=False)


def changed(monkeypatch: pytest.MonkeyPatch, **values: int) -> None:
    """Build pages with other drawing constants."""
    script = bundle(TEMPLATE / "main.js")
    for name, value in values.items():
        begin = script.index(f"const {name} = ")
        script = f"{script[:begin]}const {name} = {value};{script[script.index(';', begin) + 1 :]}"
    monkeypatch.setattr("machine.view.page.bundle", lambda _: script)
    long_print.cache_clear()


def test_a_short_print_too_is_drawn_coarsely_first(browser: Browser, tmp_path: Path) -> None:
    page = opened(browser, tmp_path, long_print())
    page.wait(IDLE)
    first, whole = (int(page.value(f"document.documentElement.dataset.{name}Ms")) for name in ("first", "whole"))
    assert int(page.value("document.documentElement.dataset.coarseMs")) > 0
    assert first < whole
    page.value(PICTURE)
    assert int(page.value("document.documentElement.dataset.drawn")) == row(page) + 1 > 6000


def test_a_panel_that_changes_its_width_while_all_is_drawn_leaves_a_picture(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    changed(monkeypatch, LEAST=2000, PIECE_MS=1)
    page = opened(browser, tmp_path, long_print())
    for frames in range(1, 6):
        page.wait(IDLE)
        page.value(f"{RESIZED_AFTER}({frames})")
        page.wait("new Promise((done) => setTimeout(() => done(true), 1100))")
    blank = page.value("document.createElement('canvas').toDataURL()")
    assert page.value(PICTURE) != blank
    assert page.complaints == []


def test_drawing_progress_stays_between_0_and_100_per_cent_while_the_slider_moves(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    changed(monkeypatch, LEAST=1000, PIECE_MS=1, TOLD_MS=-1)
    page = opened(browser, tmp_path, long_print())
    page.wait(IDLE)
    page.value(SLID_WHILE_DRAWN)
    page.wait(f"said.length > 1 && {IDLE}")
    shares = [int(words.split(":")[1].removesuffix("%")) for words in page.value("said") if words.startswith("Drawing")]
    assert shares
    assert all(0 <= share <= 100 for share in shares)


def handles(browser: Browser) -> tuple[int, int]:
    """Positions of the two handles that limit the layers."""
    low, high = (int(browser.value(f"document.getElementById('layer-{end}').value")) for end in ("low", "high"))
    return low, high


@pytest.fixture
def page(browser: Browser, tmp_path: Path) -> Browser:
    """The post and the arm: layers 1 to 3 of each."""
    profile, printed = program()
    return opened(browser, tmp_path, print_page("post and arm", printed, profile))


def last_row(part: int, layer: int) -> int:
    """The last row of a layer."""
    read = program()[1].run.program
    return int(((read.part == part) & (read.layer == layer)).nonzero()[0][-1])


def test_the_handle_of_the_highest_layer_takes_the_time_to_its_end(page: Browser) -> None:
    put(page, "layer-high", 1)
    assert row(page) == last_row(1, 2)
    put(page, "layer-high", 4)
    assert row(page) == last_row(2, 2)


def test_the_time_takes_the_handle_of_the_highest_layer_along(page: Browser) -> None:
    put(page, "position", last_row(1, 2) - 1)
    assert handles(page) == (0, 1)
    put(page, "position", 0)
    assert handles(page) == (0, 0)
    page.key("End")
    assert handles(page)[1] == 5


def test_the_handle_of_the_lowest_layer_leaves_the_time_alone_below_the_highest(page: Browser) -> None:
    put(page, "position", last_row(2, 1) - 1)
    put(page, "layer-low", 2)
    assert row(page) == last_row(2, 1) - 1
    put(page, "layer-low", 4)
    assert handles(page) == (4, 4)
    assert row(page) == last_row(2, 2)


def test_a_part_that_is_chosen_keeps_the_time_within_its_layers(page: Browser) -> None:
    put(page, "part", 2)
    assert handles(page) == (0, 2)
    put(page, "layer-high", 0)
    assert row(page) == last_row(2, 1)
    put(page, "part", 1)
    assert handles(page) == (0, 2)
