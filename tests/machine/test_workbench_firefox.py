"""The workbench in Firefox: one session through all its functions in stages, from the file to the printed part."""

import time
from collections.abc import Iterator

import pytest

from mdp.save import stl
from tests.machine.firefox import FIREFOX, PATIENCE_S, XVFB, Firefox
from tests.machine.prints import kinds_of_fields, prints_line
from tests.machine.running_workbench import Running
from tests.machine.test_workbench_page import FOUND, choose, find_as_it_lies
from tests.shapes import tee

VIEW = "$('print-page').contentDocument"
DRAWN = f"{VIEW}?.documentElement?.dataset.state === '{'failed' if XVFB is None else 'ready'}'"
PRINTING = "document.documentElement.dataset.printing"
SLICED = "!document.body.classList.contains('no-slices') && !document.body.classList.contains('stale')"
pytestmark = pytest.mark.skipif(FIREFOX is None, reason="Firefox is not installed: the workbench is not tried in it")


@pytest.fixture(scope="module")
def firefox(bench: Running) -> Iterator[Firefox]:
    with Firefox((900, 560)) as running:
        running.open(bench.address)
        running.wait("document.documentElement.dataset.line === 'open' && document.documentElement.dataset.busy === ''")
        choose(running, "tee.stl", stl(tee(6.0, 24.0, 24.0)))
        running.wait("document.documentElement.dataset.shown && $('title').textContent === 'tee.stl'")
        yield running


def middle(firefox: Firefox, element: str) -> tuple[float, float]:
    """The middle of an element, read after the next frame: handles move with the picture."""
    firefox.value("new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)))")
    x, y = firefox.value(
        f"(() => {{ const b = $('{element}').getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; }})()"
    )
    return x, y


def put(firefox: Firefox, element: str, value: object, event: str = "change") -> None:
    firefox.value(f"{{ const e = {element}; e.value = '{value}'; e.dispatchEvent(new Event('{event}')); }}")


def put_setting(firefox: Firefox, key: str, value: object) -> None:
    """Find a setting by its name, change it, and check that it is marked as changed."""
    put(firefox, "$('search-settings')", key, "input")
    firefox.wait(f"document.querySelector('[data-key=\"{key}\"]')")
    assert firefox.value("document.querySelectorAll('#settings-list [data-key]').length") == 1
    put(firefox, f"document.querySelector('[data-key=\"{key}\"]').querySelector('input, textarea')", value)
    firefox.wait(f"document.querySelector('[data-key=\"{key}\"].changed')")


def done(word: str) -> str:
    return f"$('undo').getAttribute('aria-label') === 'undo: {word}'"


def undo(firefox: Firefox, before: str) -> None:
    firefox.click("#undo")
    firefox.wait(done(before))


def test_firefox_draws_the_model_lays_it_down_and_on_a_face(firefox: Firefox) -> None:
    drawn = "document.documentElement.dataset.state === 'ready'"
    assert firefox.value(drawn) is (XVFB is not None)
    assert "24.0 × 6.0 × 24.0 mm" in firefox.value("$('model-told').textContent")
    standing = firefox.value("$('overhang').textContent")
    firefox.wait("$('resting').children.length > 1")
    firefox.click("#resting button:nth-child(2)")
    firefox.wait(done("lay the model down"))
    assert firefox.value("$('overhang').textContent") != standing
    undo(firefox, "open tee.stl")
    if XVFB is not None:
        firefox.click("[data-view=top]")
        firefox.click("#fit")
        firefox.click("#lay")
        firefox.wait("modules['page/store'].store.facets && $('lay').getAttribute('aria-pressed') === 'true'")
        firefox.press(*middle(firefox, "canvas"))
        firefox.wait(done("lay a face down"))
        assert firefox.value("$('overhang').textContent") == "0.0 mm²"  # upside down a T needs no support
        undo(firefox, "open tee.stl")
    assert firefox.value("$('overhang').textContent") == standing


def test_firefox_finds_parts_and_browses_the_front(firefox: Firefox) -> None:
    find_as_it_lies(firefox)
    assert "recommended" in firefox.value("$('front-told').textContent")
    taken = firefox.value("$('front').value")
    put(firefox, "$('front')", 0, "input")
    assert firefox.value("$('front-told').querySelector('dd').textContent") == "1"
    put(firefox, "$('front')", 0)
    firefox.wait(done("take another number of parts"))
    undo(firefox, "find parts")
    firefox.wait(f"$('front').value === '{taken}'")
    undo(firefox, "open tee.stl")
    assert firefox.value("document.body.classList.contains('no-cuts')")


def test_firefox_moves_tilts_and_locks_a_plane_and_finds_the_others_beside_a_mark(firefox: Firefox) -> None:
    firefox.click("[data-view=front]")
    firefox.click("#add")
    firefox.wait("!$('plane').hidden && $('plane-told').textContent")
    assert firefox.value("$('plane-offset').value") == "12.00"
    if XVFB is not None:
        firefox.wait("!$('handles').hidden")
        x, y = middle(firefox, "hand-along")
        firefox.drag((x, y), (x, y - 12))
        firefox.wait(done("move a plane"))
        assert 12.0 < float(firefox.value("$('plane-offset').value")) < 20.0
        firefox.value("$('hand-tilt-b').focus()")  # towards the eye
        firefox.key("ArrowUp")
        firefox.wait("Math.abs(Number($('plane-tilt').value) - 1) < 0.11")
        firefox.value("document.activeElement.blur()")
    put(firefox, "$('plane-tilt')", 30)
    cuts = "JSON.stringify(modules['page/store'].store.state.cuts)"
    firefox.wait(f"$('plane-tilt').value === '30.0' && {cuts}.includes('0.866')")  # the cosine in the bench's plane
    firefox.click("#parts-list input[type=checkbox]")
    firefox.wait("$('plane-offset').disabled && !$('find-others').disabled")
    put(firefox, "$('mark-kind')", "no_support")
    firefox.click("#mark-middle")
    firefox.wait(f"document.querySelectorAll('#marks tr').length === 1 && {done('mark: no support here')}")
    locked = firefox.value("JSON.stringify([$('plane-offset').value, $('plane-tilt').value])")
    firefox.click("#find-others")
    firefox.wait(f"{FOUND} && {done('find parts')}")
    assert firefox.value("document.querySelectorAll('#parts-list input[type=checkbox]:checked').length") == 1
    firefox.click("#parts-list .card:has([type=checkbox]:checked) input[type=radio]")
    firefox.wait("!$('plane').hidden")
    assert firefox.value("JSON.stringify([$('plane-offset').value, $('plane-tilt').value])") == locked
    assert firefox.complaints == []


@pytest.mark.parametrize("size", [(390, 844), (900, 560)])
@pytest.mark.parametrize(("tab", "fields"), [("model", ["turn-x-typed", "size-x"]), ("parts", ["plane-offset", "plane-tilt"])])
def test_firefox_shows_every_figure_of_a_number(firefox: Firefox, size: tuple[int, int], tab: str, fields: list[str]) -> None:
    firefox.resize(*size)
    firefox.click(f"#tab-{tab}")
    firefox.wait(f"innerWidth === {size[0]} && {fields}.every((id) => $(id).offsetWidth)")
    cut_off = "(e, before) => { e.value = '100.25'; const wide = e.scrollWidth > e.clientWidth; e.value = before; return wide; }"
    assert firefox.value(f"{fields}.filter((id) => ({cut_off})($(id), $(id).value))") == []


def test_firefox_draws_a_slider_that_does_not_move_fainter(firefox: Firefox) -> None:
    opacity = "((e, off) => { e.disabled = off; return getComputedStyle(e).opacity; })"
    assert firefox.value(f"[true, false].map((off) => {opacity}($('apart'), off))") == ["0.5", "1"]


def test_firefox_changes_settings_of_all_parts_and_of_one(firefox: Firefox) -> None:
    firefox.click("#tab-settings")
    put_setting(firefox, "process.walls", 1)
    put(firefox, "$('settings-part')", 2)
    firefox.wait("!document.querySelector('[data-key=\"process.walls\"].changed')")
    put_setting(firefox, "process.walls", 2)
    assert firefox.value("$('settings-part').selectedOptions[0].text") == "part 2 (1 changed)"
    put(firefox, "$('settings-part')", 0)
    assert "--set process.walls=1" in firefox.value("$('command-line').textContent")
    put_setting(firefox, "machine.gcode.before_part", "M104 S120")


def test_firefox_slices_jumps_to_a_finding_and_follows_layers_and_text(firefox: Firefox) -> None:
    firefox.click("#tab-slices")
    firefox.click("#slice")
    firefox.wait(SLICED)
    firefox.click("#sliced-findings .error")
    firefox.wait(DRAWN)
    firefox.wait(f"{VIEW}.querySelector('#findings .chosen')")
    line = firefox.value(f"{VIEW}.getElementById('readout-line').textContent")
    assert f"line {line}" in firefox.value("document.querySelector('#sliced-findings .error small').textContent")
    put(firefox, f"{VIEW}.getElementById('part')", 1)
    put(firefox, f"{VIEW}.getElementById('layer-high-number')", 3)
    assert firefox.value(f"{VIEW}.getElementById('layer-high').value") == "2"
    put(firefox, f"{VIEW}.getElementById('layer-high-mm')", 0.8)
    assert firefox.value(f"{VIEW}.getElementById('layer-high-number').value") == "2"
    firefox.click("#leave-print")
    firefox.click("#undo")  # the first part is printed hot again
    firefox.wait("document.body.classList.contains('stale')")
    firefox.click("#slice")
    firefox.wait(SLICED)
    firefox.wait(f"{VIEW}?.location.href.endsWith($('print-page').getAttribute('src')) && {DRAWN}")
    firefox.value(f"{VIEW}.getElementById('tab-code').click()")
    firefox.wait(f"{VIEW}.querySelector('#code-seen .now')")
    put(firefox, f"{VIEW}.getElementById('code-line')", 200)
    firefox.wait(f"{VIEW}.querySelector('#code-seen .now')?.dataset.line === '200'")
    assert 150 < int(firefox.value(f"{VIEW}.getElementById('readout-line').textContent")) <= 200
    put(firefox, f"{VIEW}.getElementById('position')", 300, "input")
    line = firefox.value(f"{VIEW}.getElementById('readout-line').textContent")
    firefox.wait(f"{VIEW}.querySelector('#code-seen .now')?.dataset.line === '{line}'")
    firefox.click("#leave-print")
    firefox.click("#compare")
    firefox.wait("$('compared').textContent.includes('straight up')")


@pytest.mark.parametrize(("button", "asked", "saved"), [
    ("#save-plan", "plan.toml", "tee-plan.toml"), ("#save-parts", "parts.zip", "tee-parts.zip"),
    ("#save-gcode", "print.gcode", "tee.gcode"), ("#save-page", "print.html", "tee.html"),
])  # fmt: skip
def test_firefox_saves_what_the_workbench_has_byte_by_byte(
    firefox: Firefox, bench: Running, button: str, asked: str, saved: str
) -> None:
    status, content = bench.ask(asked)
    firefox.click(button)
    end_s, file = time.monotonic() + PATIENCE_S, firefox.downloads / saved
    while not (file.is_file() and file.stat().st_size == len(content)) and time.monotonic() < end_s:
        time.sleep(0.02)
    assert (status, file.read_bytes()) == (200, content)


def test_firefox_prints_watches_takes_the_command_back_and_stops_the_machine(firefox: Firefox, bench: Running) -> None:
    with prints_line(bench, "other") as second_page:
        firefox.click("#tab-printing")
        put(firefox, "$('sim-speed')", 10)
        firefox.click("#check")
        firefox.wait("!$('run-ask').hidden")
        firefox.click("#begin")
        second_page.until(lambda state: state.get("live"))
        second_page.command("pause")
        assert second_page.refused() == "another page controls this print: take control first"
        second_page.command("take")
        firefox.wait("!$('held').hidden && $('run-commands').hidden")
        assert "Another page controls this print; this one only watches." in firefox.value("$('held-told').textContent")
        firefox.click("#take")
        firefox.wait("$('held').hidden && !$('run-commands').hidden")
        put(firefox, "$('search-settings')", "", "input")
        firefox.click("#level-all")  # so that every setting has its field
        typed, stopping = kinds_of_fields(firefox)
        assert typed == ["number", "search", "select-one", "text", "textarea"]
        assert not set(typed) & set(stopping)
        firefox.value(
            "{ $('printer-field').open = true; $('baud-line').hidden = false; $('baud').value = ''; $('baud').focus(); }"
        )
        for key in "1e3":
            firefox.key(key)
        assert firefox.value("[$('baud').value, $('baud').valueAsNumber]") == ["1e3", 1000]
        assert firefox.value(PRINTING) != "over"
        firefox.value("{ $('baud').value = 115200; $('sim-speed').focus(); }")
        firefox.key("e")  # the letter of an entry of the list
        assert firefox.value(PRINTING) != "over"
        firefox.value("$('feed').focus()")  # a slider, which takes no letter
        firefox.key("e")
        firefox.key("e")
        firefox.wait(f"{PRINTING} === 'over' && $('emergency').hidden")
        assert "emergency stop: the printer has halted" in firefox.value("$('stop-words').textContent")
        firefox.click("#stop-noted")
        assert firefox.value("$('print-bar').hidden")


def test_firefox_prints_to_the_end(firefox: Firefox) -> None:
    put(firefox, "$('sim-speed')", 0)
    firefox.click("#check")
    firefox.wait("!$('run-ask').hidden")
    firefox.click("#begin")
    firefox.wait(f"{PRINTING} === 'over'")
    assert firefox.value("$('run-state').textContent") == "the print is done"
    assert firefox.value("$('print-bar').hidden")
    assert firefox.complaints == []
