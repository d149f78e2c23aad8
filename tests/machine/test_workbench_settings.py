"""Settings on the workbench in a real browser: for all parts and for one, refused beside their field, and used by a front."""

import json
import shlex
from itertools import pairwise
from pathlib import Path

import pytest

from machine.cli.cli import main
from mdp.save import stl
from profiles.profile import load
from tests.machine.browser import CHROMIUM, Browser
from tests.machine.running_workbench import Running
from tests.machine.test_workbench_page import IDLE, choose, find_as_it_lies, open_model, saved
from tests.shapes import tee

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: the page is not tried in a browser")


def put(browser: Browser, key: str, value: object) -> None:
    """A value typed into a setting's field."""
    field = f"document.querySelector('[data-key=\"{key}\"] :is(input, textarea)')"
    browser.wait(field)
    browser.value(f"{{ const input = {field}; input.value = {json.dumps(value)}; input.dispatchEvent(new Event('change')); }}")


def changed(key: str) -> str:
    return f"document.querySelector('[data-key=\"{key}\"].changed')"


def choose_part(browser: Browser, part: int) -> None:
    browser.value(f"{{ $('settings-part').value = {part}; $('settings-part').dispatchEvent(new Event('change')); }}")


def test_settings_of_the_machine_and_of_one_part_are_set_shown_and_reset(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "settings.stl", stl(tee()))
    browser.click("#tab-settings")
    browser.click("#level-all")
    put(browser, "machine.tilt.limits_deg", "-45, 45")
    browser.wait(changed("machine.tilt.limits_deg"))
    browser.value("window.both = ['process.walls', 'process.top_layers'].map((key) => `[data-key=\"${key}\"] input`)")
    browser.value(
        "both.map((field) => document.querySelector(field)).forEach((input, k) => "
        "{ input.value = [-3, 7][k]; input.dispatchEvent(new Event('change')); })"
    )
    wrong = "document.querySelector('[data-key=\"process.walls\"] .wrong')"
    browser.wait(f"{wrong} && {wrong}.textContent")
    assert browser.value(f"{wrong}.textContent").startswith("Walls is -3")
    browser.wait(changed("process.top_layers"))
    assert browser.value("$('problem').hidden && document.querySelectorAll('.wrong:not([hidden])').length") == 1
    choose_part(browser, 1)
    browser.wait("!document.querySelector('[data-key=\"machine.tilt.limits_deg\"]')")
    put(browser, "process.walls", 5)
    browser.wait(changed("process.walls"))
    assert browser.value("$('settings-part').selectedOptions[0].text") == "part 1 (1 changed)"
    choose_part(browser, 0)
    browser.wait("$('only-changed').textContent.endsWith(' changed, 1 of parts')")
    choose_part(browser, 1)
    command_line = browser.value("$('command-line').textContent")
    assert (
        "--set 'machine.tilt.limits_deg=[-45, 45]' --set process.top_layers=7 --parts 1 --as-is --part 1:walls=5"
        " -o settings.gcode" in command_line
    )
    browser.click("#reset-settings")
    browser.wait("$('reset-settings').disabled && $('settings-part').selectedOptions[0].text === 'part 1'")
    choose_part(browser, 0)
    browser.wait("$('only-changed').textContent.endsWith(' changed')")
    browser.wait(changed("machine.tilt.limits_deg"))
    browser.click("#undo")
    browser.wait("$('undo').getAttribute('aria-label') === 'undo: set a part'")


def test_a_percentage_is_typed_as_everyone_does_and_a_comma_is_a_decimal_point(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "percent.stl", stl(tee()))
    browser.click("#tab-settings")
    field = "document.querySelector('[data-key=\"process.infill_density\"] input')"
    browser.wait(f"{field} && {field}.value === '20'")
    for typed, setting in (("12,5", "12.5%"), ("35 %", "35%")):
        browser.value(f"{field}.select(), {field}.focus()")
        for key in typed:
            browser.key(key)
        browser.value(f"{field}.dispatchEvent(new Event('change'))")
        browser.wait(f"$('command-line').textContent.includes('--set process.infill_density={setting} ')")
    browser.click("#reset-settings")
    browser.wait("!$('command-line').textContent.includes('infill_density')")


def test_settings_are_found_by_words_of_other_slicers_and_reset_by_profile(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "words.stl", stl(tee()))
    browser.click("#tab-settings")
    browser.click("#level-simple")
    keys = "[...$('settings-list').querySelectorAll('.setting')].map((row) => row.dataset.key)"
    browser.wait(f"{keys}.includes('process.walls') && !{keys}.includes('process.seam_gap')")
    assert not browser.value("$('ranking').checkVisibility() || $('modifier-help').checkVisibility()")
    for words, key in (("perimeters", "process.walls"), ("cooling", "material.fan"), ("raft", "search.pedestal_mm")):
        browser.value(f"{{ $('search-settings').value = '{words}'; $('search-settings').dispatchEvent(new Event('input')); }}")
        assert key in browser.value(keys)
    browser.value("{ $('search-settings').value = 'modifiers'; $('search-settings').dispatchEvent(new Event('input')); }")
    assert "Parts lists them under Protected areas" in browser.value("$('modifier-help').innerText")
    assert browser.value("$('settings-count').textContent") == ""  # only the help, and no message that no setting matches
    browser.click("#level-advanced")
    assert browser.value("$('ranking').checkVisibility()")
    browser.click("#level-simple")
    browser.value("{ $('search-settings').value = ''; $('search-settings').dispatchEvent(new Event('input')); }")
    put(browser, "process.walls", 5)
    put(browser, "material.nozzle_c", 222)
    browser.wait(f"{changed('process.walls')} && {changed('material.nozzle_c')}")
    browser.click("#only-changed")
    shown = browser.value(keys)
    assert {"process.walls", "material.nozzle_c"} <= set(shown)
    assert "process.bottom_layers" not in shown
    assert browser.value("document.querySelector('[data-key=\"process.walls\"] .was').textContent") == "Profile value: 3"
    browser.click("#reset-material")
    browser.wait(f"{keys}.includes('process.walls') && !{keys}.includes('material.nozzle_c')")
    assert browser.value("$('reset-material').hidden")
    browser.click("#only-changed")
    browser.click("[data-id='group process: shell'] button")
    browser.wait(f"!{keys}.includes('process.walls')")
    browser.value("document.querySelector('#axes [data-end=\"-y\"]').dispatchEvent(new Event('click'))")
    axis = "document.querySelector('#axes [data-end=x]').getAttribute('transform')"
    browser.wait(f"{axis} === 'translate(26.0 0.0)'")
    browser.open(bench.address)  # tab, groups and view are kept when the page is reloaded
    browser.wait(
        f"{keys}.length && !{keys}.includes('process.walls') && !$('settings').hidden && {axis} === 'translate(26.0 0.0)'"
    )
    browser.click("[data-id='group process: shell'] button")
    browser.click("#undo")
    browser.click("#undo")
    assert browser.complaints == []


def test_a_block_and_a_list_are_saved_as_the_profile_file_of_the_command_line(
    browser: Browser, bench: Running, tmp_path: Path
) -> None:
    open_model(browser, bench, "block.stl", stl(tee()))
    browser.click("#tab-settings")
    browser.click("#level-all")
    put(browser, "machine.gcode.before_part", "M400\nM117 {prat}")
    wrong = "document.querySelector('[data-key=\"machine.gcode.before_part\"] .wrong')?.textContent"
    browser.wait(wrong)
    assert "placeholder {prat} is not known: allowed are bed_c" in browser.value(wrong)
    assert (
        browser.value("document.querySelector('[data-key=\"machine.gcode.before_part\"] textarea').value") == "M400\nM117 {prat}"
    )
    put(browser, "machine.gcode.before_part", "M400\nM117 'part' {part}")
    browser.wait(changed("machine.gcode.before_part"))
    field = "document.querySelector('[data-key=\"machine.gcode.after_part\"] textarea')"
    browser.value(f"{{ {field}.focus(); {field}.value = 'M300'; {field}.dispatchEvent(new Event('input')); }}")
    with bench.line() as second_page:  # its changes do not reach a field in which the user types
        second_page.do("set", key="machine.gcode.after_part", value="M18")
        second_page.until(lambda state: state["undo"] == "set G-code blocks: G-code after a part")
    browser.wait("$('command-line').textContent.includes('M18')")
    assert browser.value(f"{field}.value") == "M300"
    browser.value(f"{field}.dispatchEvent(new Event('blur'))")
    assert browser.value(f"{field}.value") == "M18"
    browser.click("#undo")
    browser.wait("!$('command-line').textContent.includes('M18')")
    put(browser, "machine.head.silhouette_mm", "[\n  [0.5, 0],\n  [9, 12],\n]")
    browser.wait(changed("machine.head.silhouette_mm"))
    words = shlex.split(browser.value("$('command-line').textContent"))
    settings = [word for option, word in pairwise(words) if option == "--set" and word.startswith("machine.")]
    assert settings[-2:] == [
        r'''machine.gcode.before_part="M400\nM117 'part' {part}"''',
        "machine.head.silhouette_mm=[[0.5, 0], [9, 12]]",
    ]
    mine = tmp_path / "mine.toml"
    assert main(["profiles", "save", "generic_ac", *(f"--set={setting}" for setting in settings), "-o", str(mine)]) == 0
    assert saved(browser, "#save-machine") == mine.read_text()
    assert load(machine=str(mine)).machine == load(settings=settings).machine
    choose(browser, "mine.toml", mine.read_bytes())
    browser.wait("$('command-line').textContent.includes('--machine mine.toml')")
    assert browser.value("$('profiles-list').querySelector('select').value") == "mine.toml"
    assert browser.value("$('undo').getAttribute('aria-label')") == "undo: take mine.toml"
    browser.click("#undo")
    browser.wait("$('undo').getAttribute('aria-label') === 'undo: set Print head: Silhouette of the hot end'")
    browser.click("#undo")
    browser.wait(f"!{changed('machine.head.silhouette_mm')} && {changed('machine.gcode.before_part')}")
    assert browser.complaints == []


def test_a_front_keeps_its_rows_or_prices_or_is_dropped_by_the_effect_of_a_setting(browser: Browser, bench: Running) -> None:
    open_model(browser, bench, "front.stl", stl(tee()))
    find_as_it_lies(browser)
    row = "[...$('front-told').querySelectorAll('dd')].map((cell) => cell.textContent)"
    before = browser.value(row)
    browser.click("#tab-settings")
    browser.click("#level-all")
    put(browser, "material.nozzle_c", 222)
    browser.wait(changed("material.nozzle_c"))
    assert browser.value(row) == before
    put(browser, "process.infill_density", 100)
    browser.wait(f"{changed('process.infill_density')} && !$('front-told').textContent.includes('computing')")
    after = browser.value(row)
    assert (after[0], after[2:5]) == (before[0], before[2:5])
    assert float(after[6].split()[0]) > float(before[6].split()[0])  # metres of filament
    put(browser, "process.self_supporting_angle_deg", 40)
    browser.wait(f"{changed('process.self_supporting_angle_deg')} && $('front').disabled && {IDLE}")
    assert browser.value("$('front-stale').textContent").startswith("To choose another number, find parts again")
    assert browser.value("!$('front-field').hidden && !$('front-stale').hidden")
    browser.click("#undo")
    browser.wait("!$('front').disabled && $('front-stale').hidden")
    assert browser.value(row) == after
    assert browser.complaints == []
