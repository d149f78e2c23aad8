"""Slices in a real browser, in the page of the print and in the workbench: layers, times, text, findings, saving."""

import base64
import json
from pathlib import Path

import pytest

from machine.dryrun.dryrun import dry_run
from machine.program import Program
from machine.view import text as text_of_page
from machine.view.contents import of_print
from machine.view.page import print_page
from mdp.save import stl
from profiles.profile import load
from tests.machine import hand
from tests.machine.browser import CHROMIUM, Browser
from tests.machine.running_workbench import Running
from tests.machine.test_browser import opened, program, put, row, text
from tests.machine.test_workbench_page import open_model, saved
from tests.machine.view.test_text import FOREIGN
from tests.shapes import box, tee

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: the page is not tried in a browser")


@pytest.fixture
def page(browser: Browser, tmp_path: Path) -> Browser:
    """The post and the arm, opened as a file."""
    profile, printed = program()
    return opened(browser, tmp_path, print_page("post and arm", printed, profile))


def type_in(browser: Browser, name: str, value: object) -> None:
    browser.value(
        f"{{ const e = document.getElementById('{name}'); e.value = '{value}'; e.dispatchEvent(new Event('change')); }}"
    )


def choose_text(browser: Browser, lines: tuple[str, ...]) -> None:
    """Choose the print's file in the page as the user does."""
    content = "\n".join(lines) + "\n"
    browser.value(
        f"""{{ const chosen = new DataTransfer();
        chosen.items.add(new File([{json.dumps(content)}], 'print.gcode'));
        document.getElementById('code-file').files = chosen.files;
        document.getElementById('code-file').dispatchEvent(new Event('change')); }}"""
    )
    browser.wait("document.body.classList.contains('has-text') || document.getElementById('code-told').textContent")


def wait_for_marked(browser: Browser, number: int, lines: tuple[str, ...]) -> None:
    """Wait until this line of the text is marked; the list scrolls to it first."""
    browser.wait(f"document.querySelector('#code-seen .now')?.textContent === {json.dumps(f'{number}{lines[number - 1]}')}")


def layer(browser: Browser, end: str) -> list[str]:
    return [browser.value(f"document.getElementById('layer-{end}{of}').value") for of in ("", "-number", "-mm")]


def test_number_and_height_of_a_layer_can_be_typed(page: Browser) -> None:
    put(page, "part", 2)
    assert layer(page, "high") == ["2", "3", "0.60"]
    type_in(page, "layer-high-number", 2)
    assert layer(page, "high") == ["1", "2", "0.40"]
    type_in(page, "layer-low-mm", 0.35)
    assert layer(page, "low") == ["1", "2", "0.40"]
    type_in(page, "layer-high-number", "")
    assert layer(page, "high") == ["1", "2", "0.40"]


def test_a_click_on_a_bar_beside_the_layers_goes_to_that_layer(page: Browser) -> None:
    put(page, "position", 0)
    x, y, high = page.value(
        "(() => { const bars = document.getElementById('layer-times').getBoundingClientRect();"
        " return [bars.right - 3, bars.y, bars.height]; })()"
    )
    page.press(x, y + 8)
    top = page.value("Number(document.getElementById('layer-high').max)")
    assert layer(page, "high")[0] == str(top)
    assert row(page) > 0  # the chosen line counts as printed
    page.press(x, y + high - 8)
    assert layer(page, "high")[0] == "0"
    assert "layer 1, 0.20 mm, takes " in page.value("document.getElementById('layer-high').getAttribute('aria-valuetext')")


def test_the_text_follows_the_slider_and_the_slider_the_text(page: Browser) -> None:
    lines = hand.text("generic_ac")
    page.click("#tab-code")
    put(page, "position", 40)
    line = int(text(page, "readout-line"))
    wait_for_marked(page, line, lines)
    type_in(page, "code-line", line + 7)
    moved = row(page)
    wait_for_marked(page, line + 7, lines)
    assert int(text(page, "readout-line")) <= line + 7
    assert moved > 40
    page.value("document.getElementById('code-lines').focus()")
    page.key("ArrowUp")
    wait_for_marked(page, line + 6, lines)
    page.click(f"[data-line='{line}']")
    assert row(page) == 40


@pytest.mark.parametrize("lines", [hand.text("generic_ac"), tuple(FOREIGN.split("\n"))], ids=["ours", "foreign"])
def test_the_page_reads_the_text_out_of_its_rows_letter_for_letter(page: Browser, lines: tuple[str, ...]) -> None:
    profile = program()[0]
    block = base64.b64encode(of_print("text", Program(lines, dry_run(lines, profile), None), profile, True, (), False)).decode()
    names = "{ ...modules['moves/rows'], ...modules['panel/text'] }"
    read = "linesOfRows({ header: block.header, rows: rowsOf(block), patternOf: block.array('text')[0] })"
    all_of = f"((text) => Array.from({{ length: text.count }}, (_, k) => text.line(k + 1)))({read})"
    assert (
        tuple(page.value(f"(({{ openBlock, rowsOf, linesOfRows }}) => openBlock('{block}').then((block) => {all_of}))({names})"))
        == lines
    )


def test_a_text_that_is_not_in_the_page_comes_from_the_prints_file_and_from_no_other(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(text_of_page, "MOST_LETTERS", 0)
    profile, printed = program()
    page, lines = opened(browser, tmp_path, print_page("post and arm", printed, profile)), printed.lines
    page.click("#tab-code")
    choose_text(page, lines[:-2])
    assert f"print.gcode has {len(lines) - 2} lines; the file of this print has {len(lines)}" in text(page, "code-told")
    assert not page.value("document.body.classList.contains('has-text')")
    choose_text(page, lines)
    put(page, "position", 40)
    line = int(text(page, "readout-line"))
    wait_for_marked(page, line, lines)


# Sentence and title of each finding.
FINDINGS = "[...document.querySelectorAll('#sliced-findings button')].map((each) => [each.childNodes[1].textContent, each.title])"
FRAME = "document.getElementById('print-page').contentWindow"


def in_frame(browser: Browser, words: str) -> str:
    """An expression evaluated in the print's page inside the workbench's page."""
    return f"((document) => {words})({FRAME}.document)"


def slice_it(browser: Browser) -> None:
    browser.click("#tab-slices")
    browser.click("#slice")
    done = "$('slicing-bar').hidden && !['no-slices', 'stale'].some((word) => document.body.classList.contains(word))"
    browser.wait(done)  # do not wait for the progress bar first: a small model may already be sliced
    browser.value("$('leave-print').hidden || $('leave-print').click()")


def test_sliced_parts_appear_are_compared_previewed_and_outdated_when_the_bench_changes(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "tee.stl", stl(tee(6.0, 24.0, 24.0)))
    browser.click("#add")
    browser.wait("$('undo').getAttribute('aria-label') === 'undo: add a plane'")
    slice_it(browser)
    browser.wait("document.documentElement.dataset.walls === '1 2'")
    assert "print time" in text(browser, "sliced-told")
    head, row = browser.value("[...$('joints').rows].map((row) => [...row.cells].map((cell) => cell.textContent))")
    assert head == ["joint of part", "area", "contact", "plastic", "seam", "breaks at"]
    assert row[0] == "2"
    assert [cell.split()[-1] for cell in row[1:]] == ["mm²", "%", "%", "mm", "N"]
    browser.click("#look")
    browser.wait(f"{FRAME}?.document.documentElement?.dataset.picture === 'idle'")
    browser.value(in_frame(browser, "document.getElementById('tab-code').click()"))
    browser.wait(in_frame(browser, "document.querySelector('#code-seen .now')"))
    line = browser.value(in_frame(browser, "document.querySelector('#code-seen .now').dataset.line"))
    assert line == browser.value(in_frame(browser, "document.getElementById('readout-line').textContent"))
    browser.click("#undo")
    browser.wait("document.body.classList.contains('stale')")
    assert browser.value("[$('verdict').classList.contains('stale'), $('verdict-remedy').textContent]") == [True, "Slice again"]
    assert "Out of date" in browser.value("document.querySelector('#bar .stale-told').innerText")
    browser.click("#leave-print")
    assert browser.value("$('save-gcode').disabled && $('compare').disabled && document.documentElement.dataset.walls === ''")
    browser.click("#redo")
    browser.wait("!document.body.classList.contains('stale') && !$('save-gcode').disabled")
    assert browser.complaints == []


def test_figures_of_the_slices_before_are_not_shown_while_it_is_sliced_again(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "flat.stl", stl(box(9, 9, 1)))
    slice_it(browser)
    valid = text(browser, "sliced-told")
    look = "[$('sliced-told').textContent, $('verdict').checkVisibility(), $('verdict-print').checkVisibility()]"
    seen = f"if (state.slicing && state.sliced) window.seen = {look}"
    browser.value(f"modules['page/store'].subscribe(({{ state }}) => {{ {seen}; }})")
    with bench.line() as page:
        page.do("set", key="process.brim_mm", value="5")
    browser.wait("document.body.classList.contains('stale')")
    slice_it(browser)
    assert browser.value("window.seen") == ["print time…filament…", False, False]
    assert text(browser, "sliced-told") not in (valid, "print time…filament…")


def test_a_refused_slicing_opens_no_preview_of_what_another_page_slices(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "flat.stl", stl(box(9, 9, 1)))
    browser.click("#tab-slices")
    refused = "function (text) { window.sending.call(this, text.replace('\"slice\"', '\"compare\"')); }"
    browser.value(f"window.sending = WebSocket.prototype.send; WebSocket.prototype.send = {refused}")
    browser.click("#slice")
    browser.wait("!$('problem').hidden")
    browser.value("{ WebSocket.prototype.send = window.sending; }")
    with bench.line() as page:
        page.do("slice")
    browser.wait("$('verdict-told').textContent.startsWith('Ready to print') && $('slicing-bar').hidden")
    browser.wait("new Promise((drawn) => requestAnimationFrame(() => drawn(true)))")
    assert browser.value("$('print-page').hidden && !document.body.classList.contains('looking')")


def slice_with_errors(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "box.stl", stl(box(20, 20, 2)))
    with bench.line() as page:
        page.do("set", key="machine.gcode.start", value=f"{load().machine.gcode.start}\nM104 S120 ; not hot any more")
    browser.wait("document.querySelector('[data-key=\"machine.gcode.start\"].changed')")
    slice_it(browser)


def test_a_finding_leads_to_its_place_and_errors_are_saved_only_on_demand(browser: Browser, bench: Running) -> None:
    slice_with_errors(browser, bench)
    browser.click("#sliced-findings .error")
    browser.wait(f"{FRAME}?.document.querySelector('#findings .chosen')")
    where = (
        "[document.querySelector('#findings .chosen b').textContent, Number(document.getElementById('readout-line').textContent)]"
    )
    chosen, line = browser.value(in_frame(browser, where))
    guess = [finding for finding in browser.value(FINDINGS) if "not calibrated" in finding[0]]
    assert guess[0][1] in [
        title for _, title in browser.value(in_frame(browser, FINDINGS.replace("#sliced-findings", "#findings")))
    ]
    assert "Tilt axis: Point on the axis" in guess[0][0]
    assert "machine.tilt.point_mm" not in guess[0][0]
    assert "machine.tilt.point_mm" in guess[0][1]
    assert chosen == "error: cold-extrusion"
    assert f"line {line}" in browser.value("document.querySelector('#sliced-findings .error small').textContent")
    browser.click("#leave-print")
    assert browser.value("document.activeElement.id") == "look"
    browser.click("#save")
    assert "found errors" in browser.value("$('save-gcode').innerText")
    browser.click("#save-gcode")
    assert browser.value("$('save-anyway').matches(':popover-open')")
    assert "a nozzle that is not hot" in text(browser, "errors-list")
    assert saved(browser, "#save-errors").startswith("; generated by tiltprint")
    browser.click("#undo")
    browser.wait("document.body.classList.contains('stale')")


def test_a_print_with_slicing_errors_or_stale_slices_is_refused_at_once(browser: Browser, bench: Running) -> None:
    slice_with_errors(browser, bench)
    browser.click("#tab-printing")
    type_in(browser, "port-typed", "/dev/no-such-port")
    browser.click("#port-other")
    browser.click("#check")
    browser.wait("!$('print-problem').hidden && !$('force-line').hidden")
    problem = browser.value("$('print-problem').textContent")
    assert problem.startswith("the dry run found 2 errors, the first: ")
    assert problem.endswith("(tick Continue anyway to print it)")
    assert browser.value("$('run').hidden")  # no printer has been queried
    browser.click("#undo")
    browser.wait("$('check').disabled && $('force-line').hidden && $('print-problem').hidden")
    browser.click("#redo")
    browser.wait("!$('check').disabled")
    browser.click("#check")
    browser.wait("!$('force-line').hidden")
    browser.click("#force")
    browser.click("#check")
    browser.wait("$('run-state').textContent.startsWith('port /dev/no-such-port does not exist')")
    browser.click("#forget")
    browser.wait("$('run').hidden")
    browser.value("$('check').focus()")
    browser.click("#undo")
    browser.wait("$('check').disabled && !$('unsliced').hidden")
    assert browser.value("$('unsliced').checkVisibility()")
    assert browser.value("$('unsliced').textContent") == (
        "What is on the workbench has changed since it was sliced: slice it again."
    )
    asked = "WebSocket.prototype.send = function (text) { window.asked = text; }"
    browser.value(f"{{ window.asked = ''; window.send = WebSocket.prototype.send; {asked}; }}")
    for key in ("Enter", " "):
        browser.key(key)
    browser.click("#check")
    assert browser.value("window.asked") == ""
    browser.value("{ WebSocket.prototype.send = window.send; }")
    browser.click("#redo")
    browser.wait("!$('check').disabled && $('unsliced').hidden")
    browser.click("#undo")
    browser.wait("$('check').disabled")
    assert browser.complaints == []


def test_copies_and_pauses_are_typed_listed_and_removed(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "box.stl", stl(box(8, 8, 4)))
    browser.click("#tab-slices")
    scene = "box: [[-4, -4, 0], [4, 4, 4]], shifts: [], extras: {}"
    walls = "[[-30, -20, 0], [30, 20, 4]].map((place) => ({ places: new Float32Array(place) }))"
    names = "{ ...modules['picture/math'], ...modules['scene/picture'] }"
    framed = browser.value(f"(({{ bounds, placesDrawn }}) => bounds(placesDrawn({{ {scene}, walls: {walls} }}).flat()))({names})")
    assert framed == [[-30, -20, 0], [30, 20, 4]]  # including the walls of copies
    type_in(browser, "copies", 0)
    browser.wait("$('problem').textContent === 'Copies is 0: 1 to 1000 is allowed' && $('copies').value === '1'")
    type_in(browser, "stop-kind", "filament_change")
    type_in(browser, "stop-at", "1:x")
    browser.click("#add-stop button")
    browser.wait("$('problem').textContent.startsWith('1:x under Copies and pauses: PART:LAYER') && $('stop-at').value === '1:x'")
    type_in(browser, "stop-at", "1:2.5mm")
    browser.click("#add-stop button")
    browser.wait("$('stops').innerText.includes('part 1, at 2.5 mm') && $('stop-at').value === ''")
    browser.click("#tab-settings")
    browser.wait("$('command-line').textContent.includes('--filament-change 1:2.5mm')")
    browser.click("#tab-slices")
    browser.click("#stops [aria-label='Remove the filament change of part 1, at 2.5 mm']")
    browser.wait("!$('stops').querySelector('button')")
    assert browser.complaints == []
