"""Planes by hand on the workbench's page: a neck nearby, collisions of the head, protected areas, finding the other planes, and
a page that closes during a drag."""

import json
import zipfile
from pathlib import Path
from typing import Any

import pytest

from machine.cli.cli import main
from mdp.save import stl
from mdp.search.plan_file import PlanFile, PlannedPart
from mdp.search.search import SearchRequest, cut_by_plan
from profiles.profile import load
from tests.machine.browser import Browser
from tests.machine.running_workbench import QUICK, Running
from tests.machine.test_workbench_place import pixels
from tests.machine.workbench.test_server import colours_in
from tests.mdp.search.test_neck import hourglass
from tests.shapes import tee

LEVEL = {"normal": [0, 0, 1]}
FREE = "document.documentElement.dataset.busy === ''"


@pytest.fixture
def folder(folder: Path) -> Path:
    Path("tee.stl").write_bytes(stl(tee()))
    Path("glass.stl").write_bytes(stl(hourglass()))
    return folder


def opened(page: Any, bench: Running, name: str) -> None:
    before = page.state["model"] and page.state["model"]["key"]
    bench.send(Path(name))
    page.until(lambda state: state["model"] and state["model"]["key"] != before and not state["busy"])


def added(page: Any, *offsets_mm: float) -> None:
    for offset_mm in offsets_mm:
        parts = page.state["parts"] or 1
        page.do("add", **LEVEL, offset_mm=offset_mm)
        page.until(lambda state, want=parts + 1: state["parts"] == want)


def looked_at(browser: Browser, bench: Running, name: str) -> None:
    browser.open(bench.address)
    browser.wait(f"document.documentElement.dataset.shown && $('title').textContent === {json.dumps(name)} && {FREE}")
    browser.click("#tab-parts")


def test_a_plane_snaps_to_the_narrowest_section_nearby_or_reports_that_there_is_none(bench: Running, folder: Path) -> None:
    with bench.line() as page:
        opened(page, bench, "glass.stl")
        added(page, 35.0)
        page.do("neck", part=2)
        state = page.until(lambda state: state["undo"] == "snap to the narrowest section")
        assert state["cuts"][0]["offset_mm"] == pytest.approx(30.0, abs=0.05)
        page.do("move", part=2, **LEVEL, offset_mm=5.0)
        page.until(lambda state: state["undo"] == "move a plane")
        page.do("neck", part=2)
        problem = page.until(lambda state: state["problem"])["problem"]
        where = "within 10 mm and 25 degrees no section is narrower than its surroundings"
        assert problem == f"there is no narrower section near the plane of part 2: {where}"


def test_marks_are_in_the_plan_of_the_command_line_and_planes_that_they_forbid_are_invalid(bench: Running, folder: Path) -> None:
    with bench.line() as page:
        opened(page, bench, "tee.stl")
        added(page, 20.0, 35.0)
        page.do("mark", kind="no_seam", point_mm=[0.0, 5.0, 10.0], angle_deg=10)
        page.do("mark", kind="no_support", min_mm=[5, -6, 25], max_mm=[21, 6, 31])
        state = page.until(lambda state: len(state["zones"]) == 2)
        assert [zone["kind"] for zone in state["zones"]] == ["no_seam", "no_support"]
        assert sum(byte == 2 for byte in bench.ask(f"marks/{state['marks']}")[1]) == 6  # the flat back of the T
        page.do("mark", kind="keep", min_mm=[-2, -2, 33], max_mm=[2, 2, 37])
        state = page.until(lambda state: state["note"])
        why = "its plane would pass through protected area 1"
        assert (state["note"], state["problem"]) == (f"part 3 cannot be cut off: {why}", "")
        assert ([cut["offset_mm"] for cut in state["cuts"]], state["invalid"]) == ([20.0, 35.0], ["", why])
        page.do("slice")
        refused = f"part 3 cannot be cut off: {why}: move or remove its plane, or find parts again"
        assert page.until(lambda state: state["problem"])["problem"] == refused
        page.do("move", part=2, **LEVEL, offset_mm=21.0)  # the other planes can still be moved
        state = page.until(lambda state: state["cuts"][0]["offset_mm"] == 21.0)
        assert page.until(lambda state: state["invalid"] == ["", why])["problem"] == ""
        page.do("undo")
        page.do("remove", part=3)
        page.until(lambda state: state["parts"] == 2)
        Path("plan.toml").write_bytes(bench.ask("plan.toml")[1])
        plan = Path("plan.toml").read_text()
        assert all(
            text in plan for text in ("[[no_support]]", "point_mm = [0.0, 5.0, 10.0]", "[[keep]]", "max_mm = [2.0, 2.0, 37.0]")
        )
        assert main(["decompose", "tee.stl", *QUICK, "--plan", "plan.toml", "-o", "parts"]) == 0
        page.do("undo")
        page.do("undo")
        state = page.until(lambda state: len(state["zones"]) == 2)
        assert (len(state["cuts"]), state["invalid"]) == (2, ["", ""])


def test_strokes_of_a_brush_join_one_zone_and_an_eraser_takes_faces_from_all(bench: Running, folder: Path) -> None:
    with bench.line() as page:
        opened(page, bench, "tee.stl")

        def kinds(state: Any) -> list[tuple[str, Any]]:
            return [(zone["kind"], zone.get("faces")) for zone in state["zones"]]

        page.do("brush", kind="support", faces="0-3")
        page.until(lambda state: kinds(state) == [("support", 4)])
        page.do("brush", kind="support", faces="3-5 8")
        page.until(lambda state: kinds(state) == [("support", 7)])
        page.do("brush", kind="no_support", faces="8")  # the newest stroke counts
        page.until(lambda state: kinds(state) == [("no_support", 1), ("support", 6)])
        page.do("mark", kind="no_support", point_mm=[0.0, 5.0, 10.0], angle_deg=10)
        state = page.until(lambda state: len(state["zones"]) == 3 and state["marks"])
        grown = [face for face, byte in enumerate(bench.ask(f"marks/{state['marks']}")[1]) if byte & 4]
        page.do("brush", kind="no_support", faces=f"{next(face for face in grown if face != 8)}", erase=True)
        state = page.until(lambda state: state["undo"] == "take a mark away")
        assert kinds(state) == [("no_support", 1), ("no_support", len(grown) - 1), ("support", 6)]
        Path("plan.toml").write_bytes(bench.ask("plan.toml")[1])
        assert 'faces = "0-5"' in Path("plan.toml").read_text()
        bench.send(Path("plan.toml"))
        again = page.until(lambda state: not state["undo"].startswith("take a mark") and not state["busy"])
        assert kinds(again) == kinds(state)
        page.do("undo")
        page.do("undo")
        page.until(lambda state: kinds(state) == [("no_support", 1), ("no_support", None), ("support", 6)])


def test_brushed_faces_are_in_a_project_and_on_the_turned_model_the_same(bench: Running, folder: Path) -> None:
    with bench.line() as page:
        opened(page, bench, "glass.stl")
        page.do("brush", kind="no_seam", faces="3-9 40 100-130")
        page.do("turn", axis="x", deg=90)
        state = page.until(lambda state: state["undo"] == "turn the model" and state["marks"])
        marks = bench.ask(f"marks/{state['marks']}")[1]
        assert [face for face, byte in enumerate(marks) if byte] == [*range(3, 10), 40, *range(100, 131)]
        status, project = bench.ask("project.3mf")
        assert status == 200
        Path("kept.3mf").write_bytes(project)
        opened(page, bench, "kept.3mf")
        again = page.until(lambda state: state["zones"] and state["marks"])
        assert bench.ask(f"marks/{again['marks']}")[1] == marks


def test_a_mark_ends_the_search_that_knew_nothing_of_it(bench: Running, folder: Path) -> None:
    with bench.line() as page:
        opened(page, bench, "tee.stl")
        page.do("search")
        page.do("mark", kind="no_seam", min_mm=[0, 0, 0], max_mm=[1, 1, 1])
        state = page.until(lambda state: state["undo"] == "mark: no seam here" and not state["search"])
        assert (len(state["zones"]), state["front"]) == (1, [])


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"kind": "seam"}, 'kind is "seam": it must be one of "keep", "no_seam", "no_support", "support"'),
        ({"kind": "keep", "point_mm": [0, 0, 52], "angle_deg": 5}, "12 mm from the model: up to 1 is allowed"),
        ({"kind": "keep", "point_mm": [0, 0, 40], "angle_deg": 190}, "angle_deg is 190: it must be a number from 0 to 180"),
        ({"kind": "keep", "min_mm": [0, 0, 0], "max_mm": [1, 0, 1]}, "each number of min_mm must be less"),
        ({"kind": "keep", "number": 1, "min_mm": [0, 0, 0], "max_mm": [1, 1, 1]}, "number is 1: there is none yet"),
    ],
)
def test_a_mark_that_makes_no_sense_is_one_sentence(bench: Running, folder: Path, asked: dict[str, Any], said: str) -> None:
    with bench.line() as page:
        opened(page, bench, "tee.stl")
        page.do("mark", **asked)
        assert said in page.until(lambda state: state["problem"])["problem"]


@pytest.mark.parametrize(
    ("faces", "said"),
    [
        ("0-99999", "faces has 99999, but the model's 28 faces are numbered from 0 to 27"),
        ("some", 'faces is "some": numbers and ranges of faces are expected, as "0-11 15 20-24"'),
    ],
)
def test_a_stroke_that_makes_no_sense_is_one_sentence(bench: Running, folder: Path, faces: str, said: str) -> None:
    with bench.line() as page:
        opened(page, bench, "tee.stl")
        page.do("brush", kind="keep", faces=faces)
        assert said in page.until(lambda state: state["problem"])["problem"]


def test_an_impossible_print_order_is_refused_with_the_obstacle(bench: Running, folder: Path) -> None:
    with bench.line() as page:
        opened(page, bench, "tee.stl")
        added(page, 20.0, 35.0)
        page.do("reorder", part=2, to=3)
        problem = page.until(lambda state: state["problem"])["problem"]
        assert problem.startswith(
            "part 2 cannot be printed as number 3, for then part 2 cannot be cut off: nothing is left above"
        )
        assert [cut["offset_mm"] for cut in page.state["cuts"]] == [20.0, 35.0]


def test_a_page_closed_during_a_drag_leaves_the_plan_unchanged(bench: Running, folder: Path) -> None:
    with bench.line() as page:
        opened(page, bench, "tee.stl")
        added(page, 35.0)
    before = bench.ask("plan.toml")[1]
    with bench.line() as page:
        for offset_mm in (36.0, 60.0, 36.5):
            page.do("try", part=2, **LEVEL, offset_mm=offset_mm)
    assert bench.ask("plan.toml")[1] == before
    with bench.line() as page:
        assert page.state["cuts"] == [{"normal": [0.0, 0.0, 1.0], "offset_mm": 35.0}]
        page.do("move", part=2, **LEVEL, offset_mm=36.0)
        assert page.until(lambda state: state["undo"] == "move a plane")["cuts"][0]["offset_mm"] == 36.0


def test_the_head_is_drawn_where_it_would_collide_and_disappears_with_the_plane(
    browser: Browser, bench: Running, folder: Path
) -> None:
    with bench.line() as page:
        opened(page, bench, "tee.stl")
        page.do("add", normal=[0, 0, 1], offset_mm=10.0)
        page.until(lambda state: state["parts"] == 2)
        looked_at(browser, bench, "tee.stl")
        browser.click("#parts-list input[value='2']")
        page.do("move", part=2, normal=[0.6, 0, 0.8], offset_mm=5.0)
        browser.wait("document.documentElement.dataset.obstacle")
        assert page.until(lambda state: state["refused"])["refused"]["obstacle"]["touch"] is not None
        assert browser.value("document.documentElement.dataset.obstacle") == "head"
        page.do("move", part=2, normal=[0, 0, 1], offset_mm=11.0)
        browser.wait("document.documentElement.dataset.obstacle === ''")


def test_a_model_on_a_pedestal_is_drawn_on_it_and_has_the_figures_of_the_search(
    browser: Browser, bench: Running, folder: Path
) -> None:
    with bench.line() as page:
        opened(page, bench, "tee.stl")
        page.do("set", key="search.pedestal_mm", value="12")
        assert page.until(lambda state: state["pedestal"])["overhang_mm2"] == pytest.approx(300.0)
        added(page, 50.0)
        trial = page.until(lambda state: state["trial"] and state["trial"]["cuts"])["trial"]
        given = [setting.removeprefix("--set=") for setting in QUICK if setting != "--set"]
        plan = PlanFile("", parts=(PlannedPart((0.0, 0.0, 1.0), 50.0),))
        row = cut_by_plan(tee(), "tee", load(settings=[*given, "search.pedestal_mm=12"]), SearchRequest(plan=plan)).chosen
        assert row is not None
        assert (trial["support_area_mm2"], trial["seam_mm"]) == pytest.approx((row.support_area_mm2, row.seam_mm))
        looked_at(browser, bench, "tee.stl")
        browser.wait(f"document.documentElement.dataset.pedestal === '{page.state['pedestal']}'")
        browser.click("#parts-list input[value='2']")
        browser.wait("!$('handles').hidden")  # the plane meets the model, which is 40 mm tall, 38 mm above the pedestal
        page.do("set", key="search.pedestal_mm", value=None)
        assert page.until(lambda state: not state["pedestal_mm"])["cuts"][0]["offset_mm"] == 38.0
        browser.wait("document.documentElement.dataset.pedestal === '' && !$('handles').hidden")
        assert browser.complaints == []


def box_mm(zone: dict[str, Any]) -> list[float]:
    return [high - low for low, high in zip(zone["min_mm"], zone["max_mm"], strict=True)]


MODIFIED = """version = 1
[[modifier]]
z_mm = [10, 20]
process = {infill_density = 1.0}
"""


def test_a_plan_s_modifiers_are_listed_and_drawn(browser: Browser, bench: Running, folder: Path) -> None:
    Path("modified.toml").write_text(MODIFIED)
    with bench.line() as page:
        opened(page, bench, "tee.stl")
        looked_at(browser, bench, "tee.stl")
        Path("bare.toml").write_text(MODIFIED.partition("[[modifier]]")[0] + "[[part]]")
        bench.send(Path("bare.toml"))
        page.until(lambda state: state["parts"] == 1)
        browser.wait(FREE)
        bare = pixels(browser)
        bench.send(Path("modified.toml"))
        page.until(lambda state: state["modifiers"])
        browser.wait("document.querySelectorAll('#marks tr').length === 1")
        assert browser.value("$('marks').textContent") == "modifierInfill density = 100 %"
        browser.wait("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))")
        assert (pixels(browser) != bare).any(axis=2).mean() > 0.005


def test_faces_and_boxes_are_marked_by_clicks_moved_and_taken_away(browser: Browser, bench: Running, folder: Path) -> None:
    with bench.line() as page:
        opened(page, bench, "tee.stl")
        looked_at(browser, bench, "tee.stl")
        browser.click("[data-view=front]")
        browser.click("#fit")
        browser.value("{ $('mark-kind').value = 'no_seam'; }")
        browser.click("#mark-faces")
        browser.press(*browser.middle("#canvas"))
        browser.wait("document.querySelectorAll('#marks tr').length === 1 && document.documentElement.dataset.marks")
        assert "faces up to 20°" in browser.value("$('marks').textContent")
        browser.key("Escape")
        assert browser.value("$('mark-faces').getAttribute('aria-pressed')") == "false"
        browser.click("#mark-faces")
        browser.click("#tab-model")  # marks have no effect on this tab, so a click there marks nothing
        assert browser.value("$('notice').hidden")
        browser.click("#tab-parts")
        browser.click("#marks input[type=radio]")
        browser.value("{ $('mark-angle').value = 95; $('mark-angle').dispatchEvent(new Event('change')); }")
        browser.wait("$('marks').textContent.includes('faces up to 95°')")
        browser.click("#mark-middle")
        browser.wait(
            "document.querySelectorAll('#marks tr').length === 2 && !$('mark-numbers').hidden && !$('mark-handles').hidden"
        )
        before = browser.value("document.querySelector('#mark-numbers [data-side=\"max_mm 2\"]').value")
        browser.value("document.querySelector('#mark-handles [data-side=\"max_mm 2\"]').focus()")
        browser.key("ArrowUp")
        browser.wait(f"document.querySelector('#mark-numbers [data-side=\"max_mm 2\"]').value - {before} > 0.4 && {FREE}")
        zone = page.until(
            lambda state: any(abs(z.get("max_mm", [0, 0, 0])[2] - float(before) - 0.5) < 0.01 for z in state["zones"])
        )["zones"][1]
        assert zone["kind"] == "no_seam"
        page.do("turn", axis="y", deg=30)
        browser.wait(f"$('marks').textContent.includes('leaning') && {FREE}")
        browser.value("document.querySelector('#mark-handles [data-side=\"max_mm 0\"]').focus()")
        browser.key("ArrowUp")
        leaning = page.until(lambda state: any(box_mm(z)[0] - box_mm(zone)[0] > 0.4 for z in state["zones"] if "min_mm" in z))
        assert box_mm(leaning["zones"][1])[1:] == pytest.approx(box_mm(zone)[1:])
        page.do("undo")
        page.do("undo")
        browser.wait(f"!$('marks').textContent.includes('leaning') && {FREE}")
        browser.click("#marks button")
        browser.wait("document.querySelectorAll('#marks tr').length === 1")
        browser.click("#undo")
        browser.wait("document.querySelectorAll('#marks tr').length === 2")
        assert browser.complaints == []


def test_other_planes_are_found_beside_a_locked_one_and_avoid_protected_areas(
    browser: Browser, bench: Running, folder: Path
) -> None:
    with bench.line() as page:
        opened(page, bench, "tee.stl")
        added(page, 35.0)
        page.do("mark", kind="keep", min_mm=[5.5, -4, 25], max_mm=[12, 4, 32])
        looked_at(browser, bench, "tee.stl")
        assert browser.value("$('find-others').disabled")
        page.do("lock", part=2, locked=True)
        browser.wait("!$('find-others').disabled")
        browser.click("#find-others")
        state = page.until(lambda state: state["front"] and not state["search"])
        assert {"normal": [0.0, 0.0, 1.0], "offset_mm": 35.0} in state["cuts"]
        assert len(state["cuts"]) > 1
        for cut in state["cuts"]:
            x, y, z = cut["normal"]
            heights = [x * a + y * b + z * c - cut["offset_mm"] for a in (5.5, 12) for b in (-4, 4) for c in (25, 32)]
            assert not min(heights) < -1e-6 < 1e-6 < max(heights)


def test_a_plane_in_a_protected_area_stays_with_its_reason_on_card_tools_and_slice_button(
    browser: Browser, bench: Running, folder: Path
) -> None:
    with bench.line() as page:
        opened(page, bench, "tee.stl")
        added(page, 20.0, 35.0)
        looked_at(browser, bench, "tee.stl")
        browser.click("#parts-list input[value='3']")
        page.do("mark", kind="keep", min_mm=[-2, -2, 33], max_mm=[2, 2, 37])
        reason = "Cannot be cut off here: its plane would pass through protected area 1."
        browser.wait(f"$('plane-told').textContent === {json.dumps(reason)}")
        cards = browser.value("[...document.querySelectorAll('#parts-list .card .invalid')].map((text) => text.textContent)")
        assert cards == [reason]
        why = "part 3 cannot be cut off: its plane would pass through protected area 1: move or remove its plane"
        assert browser.value("$('unsliceable').textContent") == f"Cannot be sliced: {why}, or find parts again."
        browser.click("#put-near")
        browser.wait(f"$('unsliceable').textContent === '' && {FREE}")
        assert page.until(lambda state: state["invalid"] == ["", ""])["cuts"][0]["offset_mm"] == 20.0
        assert browser.complaints == []


def test_the_handles_of_a_plane_have_labels_and_colours(browser: Browser, bench: Running, folder: Path) -> None:
    with bench.line() as page:
        opened(page, bench, "tee.stl")
        added(page, 20.0)
        looked_at(browser, bench, "tee.stl")
        browser.click("#parts-list input[value='2']")
        browser.wait("!$('handles').hidden")
        seen = "[...$('handles').children].map((knob) => [getComputedStyle(knob, '::after').content, knob.title.split(' ')[0]])"
        assert browser.value(seen) == [['"move"', "Move"], ['"turn"', "Turn"], ['"tilt"', "Tilt"]]
        colours = "new Set([...$('handles').children].map((knob) => getComputedStyle(knob).backgroundColor)).size"
        assert browser.value(colours) == 3


def test_the_chosen_plane_is_seen_through_a_thick_model_and_about_it(browser: Browser, bench: Running, folder: Path) -> None:
    with bench.line() as page:
        opened(page, bench, "tee.stl")
        added(page, 20.0)
        looked_at(browser, bench, "tee.stl")
        browser.click("[data-view='top']")  # the arms hide the cut
        browser.value("$('handles').style.visibility = $('plane-tools').style.visibility = 'hidden'")
        browser.click("#parts-list input[value='1']")
        before, drawn = pixels(browser).astype(int), browser.value("document.documentElement.dataset.drawn")
        browser.click("#parts-list input[value='2']")
        browser.wait(f"document.documentElement.dataset.drawn !== '{drawn}'")
        after = pixels(browser).astype(int)
        arms = before[..., 0] - before[..., 2] > 60  # orange
        veiled = arms & (abs(after - before).sum(axis=2) > 20)
        assert arms.sum() > veiled.sum() > 100


def test_a_click_on_a_number_below_the_slider_chooses_it_and_compares_its_costs_with_one_part(
    browser: Browser, bench: Running, folder: Path
) -> None:
    with bench.line() as page:
        opened(page, bench, "tee.stl")
        looked_at(browser, bench, "tee.stl")
        page.do("search", orient=False)
        rows = page.until(lambda state: state["front"] and not state["search"] and state["priced"])["front"]
        one, row = rows[0], next(row for row in rows if row["parts"] > 1)
        browser.wait(f"$('front-marks').children.length === {len(rows)} && {FREE}")
        browser.value(f"$('front-marks').children[{rows.index(row)}].querySelector('button').click()")
        page.until(lambda state: state["parts"] == row["parts"])
        less = round(100 * (1 - row["support_area_mm2"] / one["support_area_mm2"]))
        browser.wait(f"$('front-told').textContent.includes('against 1 part−{less} % support, ')")


def test_earlier_work_is_opened_with_a_plane_that_its_mark_forbids(bench: Running, folder: Path) -> None:
    with bench.line() as page:
        opened(page, bench, "tee.stl")
        added(page, 20.0, 35.0)
        page.do("mark", kind="keep", min_mm=[-2, -2, 33], max_mm=[2, 2, 37])
        page.until(lambda state: state["note"])
        opened(page, bench, "glass.stl")
        work = json.loads(bench.ask("kept")[1])[0]
        assert work["name"] == "tee.stl"
        status, picture = bench.ask(f"kept/{work['key']}/picture")  # the whole model, because a plane cannot be cut
        assert (status, colours_in(picture)) == (200, set())
        assert bench.ask(f"kept/{work['key']}", "POST", b"", Origin=f"http://127.0.0.1:{bench.port}")[0] == 200
        state = page.until(lambda state: state["model"]["name"] == "tee.stl" and any(state["invalid"]))
        assert state["invalid"] == ["", "its plane would pass through protected area 1"]


def test_work_with_a_plane_in_a_protected_area_is_saved_as_project_and_plan_and_its_parts_wait_for_the_plane(
    bench: Running, folder: Path
) -> None:
    why = "its plane would pass through protected area 1"
    with bench.line() as page:
        opened(page, bench, "tee.stl")
        added(page, 20.0, 35.0)
        page.do("mark", kind="keep", min_mm=[-2, -2, 33], max_mm=[2, 2, 37])
        state = page.until(lambda state: state["note"])
        refused = f"part 3 cannot be cut off: {why}: move or remove its plane, or find parts again"
        assert [state["savable"][kind][0] for kind in ("project", "plan", "parts", "pictures")] == ["", "", refused, refused]
        for file in ("parts.zip", "pictures.zip"):
            status, told = bench.ask(file)
            assert (status, json.loads(told)) == (422, {"problem": refused})
        for file, name in (("project.3mf", "kept.3mf"), ("plan.toml", "kept.toml")):
            status, saved = bench.ask(file)
            assert status == 200
            Path(name).write_bytes(saved)
        with zipfile.ZipFile("kept.3mf") as archive:
            pictures = [archive.read(name) for name in archive.namelist() if name.endswith(".png")]
        assert [colours_in(picture) for picture in pictures] == [{"blue"}]  # of one part
        bench.send(Path("kept.toml"))
        again = page.until(lambda state: state["undo"] == "open kept.toml")
        assert again["note"].endswith(f"part 3 cannot be cut off: {why}")
        opened(page, bench, "glass.stl")
        bench.send(Path("kept.3mf"))
        again = page.until(lambda state: state["model"]["name"] == "tee.stl" and any(state["invalid"]))
        assert ([cut["offset_mm"] for cut in again["cuts"]], again["invalid"]) == ([20.0, 35.0], ["", why])


def test_a_message_about_a_project_s_plane_names_the_project_alone(
    bench: Running, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with bench.line() as page:
        opened(page, bench, "tee.stl")
        added(page, 20.0, 35.0)
        page.do("mark", kind="keep", min_mm=[-2, -2, 33], max_mm=[2, 2, 37])
        page.until(lambda state: state["note"])
        Path("kept.3mf").write_bytes(bench.ask("project.3mf")[1])
    capsys.readouterr()
    assert main(["decompose", "kept.3mf", *QUICK, "-o", "parts"]) == 1
    sentence, why = capsys.readouterr().err.splitlines()[-1], "its plane would pass through zone 1 of [[keep]], which stays whole"
    assert sentence == f"tiltprint: plan kept.3mf: part 3 cannot be cut off: {why}"


@pytest.mark.parametrize("file", ["", "project.3mf"])  # opened from earlier work, or from a project
def test_rows_of_the_front_are_unchanged_when_work_with_a_moved_plane_is_opened_again(
    bench: Running, folder: Path, file: str
) -> None:
    with bench.line() as page:
        opened(page, bench, "tee.stl")
        page.do("search", orient=False)
        page.until(lambda state: state["front"] and not state["search"])
        (plane,) = page.state["cuts"]
        page.do("move", part=2, normal=plane["normal"], offset_mm=plane["offset_mm"] - 2.0)
        before = page.until(lambda state: state["by_hand"])
        if file:
            Path("kept.3mf").write_bytes(bench.ask(file)[1])
        opened(page, bench, "glass.stl")
        if file:
            bench.send(Path("kept.3mf"))
        else:
            work = json.loads(bench.ask("kept")[1])[0]
            assert bench.ask(f"kept/{work['key']}", "POST", b"", Origin=f"http://127.0.0.1:{bench.port}")[0] == 200
        again = page.until(lambda state: state["model"]["name"] == "tee.stl" and state["by_hand"])
        same = ("front", "recommended", "cuts", "by_hand")
        assert {key: again[key] for key in same} == {key: before[key] for key in same}
        assert again["cuts"] != again["front"][1]["planes"]


def test_a_search_with_a_locked_plane_in_a_protected_area_names_its_part_and_the_remedy(bench: Running, folder: Path) -> None:
    with bench.line() as page:
        opened(page, bench, "tee.stl")
        added(page, 20.0, 35.0)
        page.do("lock", part=3, locked=True)
        page.do("mark", kind="keep", min_mm=[-2, -2, 33], max_mm=[2, 2, 37])
        page.until(lambda state: any(state["invalid"]))
        page.do("search")
        why = "its plane would pass through protected area 1: unlock it or take the mark back, or the setting that forbids it"
        state = page.until(lambda state: state["problem"])
        assert (state["problem"], state["search"]) == (f"part 3 is locked and cannot be cut off: {why}", None)


def test_a_number_below_the_slider_keeps_the_focus_when_it_is_taken(browser: Browser, bench: Running, folder: Path) -> None:
    with bench.line() as page:
        opened(page, bench, "tee.stl")
        looked_at(browser, bench, "tee.stl")
        page.do("search", orient=False)
        page.until(lambda state: state["front"] and not state["search"] and state["priced"])
        browser.wait(f"$('front-marks').children.length === 2 && {FREE}")
        browser.value("$('front-marks').querySelector('button').focus()")
        browser.value("document.activeElement.click()")
        page.until(lambda state: state["parts"] == 1)
        browser.wait(f"$('front').value === '0' && {FREE}")
        assert browser.value("document.activeElement.textContent") == "1"


def test_on_a_phone_the_offset_of_a_plane_is_shown_whole(browser: Browser, bench: Running, folder: Path) -> None:
    with bench.line() as page:
        opened(page, bench, "tee.stl")
        added(page, 27.14)
        looked_at(browser, bench, "tee.stl")
        browser.resize(390, 844)
        browser.value("document.querySelector(\"#parts-list input[value='2']\").click()")
        browser.wait("!$('plane-tools').hidden && $('plane-offset').value === '27.14'")
        room_px, text_px, buttons = browser.value(
            "(() => { const field = $('plane-offset'), style = getComputedStyle(field), text = document.createElement('span');"
            "Object.assign(text.style, { position: 'absolute', fontFamily: style.fontFamily, fontSize: style.fontSize });"
            "text.textContent = '-127.14'; document.body.append(text); const width = text.offsetWidth; text.remove();"
            "return [field.clientWidth - 2 * parseFloat(style.paddingLeft), width, style.appearance]; })()"
        )
        assert (room_px >= text_px, buttons) == (True, "textfield")  # without the step buttons, which cover the end of the field
        assert browser.value("$('plane-tools').offsetHeight < 90")  # still one row of tools and one of figures
        browser.resize(1280, 800)
