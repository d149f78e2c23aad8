"""Several models on the plate of the workbench: added, printed as by the command line, and kept."""

import json
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest

from machine.cli.cli import main
from machine.cli.commands.export import save
from machine.pipeline.project import unpack
from machine.pipeline.requests import ModelRequest
from machine.workbench.bench.bench import Bench, History, Step, with_beside, with_profile
from machine.workbench.bench.settings import export_command, profile_as_given, with_typed
from mdp.save import stl
from profiles.errors import PlanError
from profiles.profile import load
from tests.machine.running_workbench import Page, Running
from tests.machine.workbench.models import changed, changed_bench, model
from tests.shapes import box, tee


@pytest.fixture
def folder(folder: Path) -> Path:
    (folder / "tee.stl").write_bytes(stl(tee()))
    (folder / "box.stl").write_bytes(stl(box(8, 8, 2)))
    return folder


def two(copies: int = 1) -> Bench:
    """One or more copies of a tee, with two boxes beside it."""
    return with_beside(Bench(load(), model(), copies=copies), (Bench(load(), model("box.stl"), copies=2),))


def on_plate(state: dict[str, Any]) -> list[tuple[str, int]]:
    return [(other["name"], other["copies"]) for other in state["beside"]]


def test_the_number_of_another_model_is_changed_and_zero_removes_it() -> None:
    steps = History(Step("", two()))
    assert changed(steps, "beside", number=1, count=3).now.bench.beside[0].copies == 3
    without = changed(steps, "beside", number=1, count=0)
    assert (without.now.bench.beside, without.undo().now.bench.beside) == ((), steps.now.bench.beside)
    with pytest.raises(PlanError, match="number is 2: 1 to 1 is allowed"):
        changed(steps, "beside", number=2, count=1)


def test_a_model_is_on_the_plate_once_and_a_plate_has_at_most_a_thousand() -> None:
    with pytest.raises(PlanError, match=r"tee\.stl is on the plate already: set its number of copies to print more"):
        with_beside(two(), (Bench(load(), model()),))
    with pytest.raises(PlanError, match="1001 models are to stand on the plate: 1000 at most are allowed"):
        changed_bench(two(), "copies", count=999)


def test_the_other_models_stay_when_the_first_is_turned_and_decide_the_print_but_not_its_parts() -> None:
    plate = two()
    turned = changed_bench(plate, "turn", axis="z", deg=30)
    alone = changed_bench(turned, "beside", number=1, count=0)
    assert turned.beside == plate.beside
    assert (turned.sought == alone.sought, turned.printed == alone.printed) == (True, False)


def test_the_command_line_of_several_models_exports_their_project() -> None:
    assert export_command(two(copies=3)) == "tiltprint export tee.3mf -o tee.gcode"


def test_work_on_another_model_leaves_the_plate_and_its_print_unchanged() -> None:
    plate = two(copies=3)
    other = changed_bench(plate, "work_on", number=1)
    assert [each.model for each in other.plate] == [each.model for each in plate.plate]
    assert (other.model, other.copies, other.number) == (plate.beside[0].model, 2, 1)
    assert (other.printed == plate.printed, changed_bench(other, "work_on", number=1).printed == plate.printed) == (True, True)
    turned = changed_bench(other, "turn", axis="x", deg=90)
    back = changed_bench(turned, "work_on", number=1)
    assert (back.rotation, back.beside[0].rotation, back.number) == (plate.rotation, turned.rotation, 0)


def test_the_plate_keeps_its_order_when_a_model_before_the_one_in_work_is_removed() -> None:
    three = with_beside(two(), (*two().beside, Bench(load(), model("last.stl"))))
    last = changed_bench(three, "work_on", number=2)
    left = changed_bench(last, "beside", number=1, count=0)
    assert [each.model and each.model.name for each in left.plate] == ["box.stl", "last.stl"]
    assert left.number == 1


def test_a_setting_reaches_all_models_but_each_keeps_the_settings_of_its_own_parts() -> None:
    bench = changed_bench(two(), "set_part", part=1, key="process.walls", value="5")
    given = with_typed(bench.given, "process.layer_height_mm", "0.1", bench.profile)
    other = changed_bench(with_profile(bench, given, profile_as_given(given, bench.profile)), "work_on", number=1)
    assert (other.profile.process.layer_height_mm, other.given, other.profile.parts) == (0.1, given, [])
    assert [own.process for own in other.beside[0].profile.parts] == [{"walls": 5}]


def add(bench: Running, file: Path) -> tuple[int, bytes]:
    """Add a file to the plate as a page of this server does."""
    return bench.ask(f"file?name={file.name}&add=yes", "POST", file.read_bytes(), Origin=f"http://127.0.0.1:{bench.port}")


def sliced(page: Page) -> dict[str, Any]:
    page.do("slice")
    return page.until(lambda state: state["sliced"] and not state["sliced"]["stale"] and not state["slicing"])


def drawn(bench: Running, state: dict[str, Any]) -> tuple[int, float]:
    """Number of faces, and height in mm, of the drawn bodies of the other models."""
    content = bench.ask(f"others/{state['others']}")[1]
    points, faces = np.frombuffer(content, "<u4", 2)
    vertices = np.frombuffer(content, "<f8", 3 * points, 8).reshape(-1, 3)
    return int(faces), round(float(vertices[:, 2].max()), 6)


def test_the_g_code_of_a_plate_is_that_of_its_project_on_the_command_line_and_the_plate_is_kept(
    bench: Running, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with bench.line() as page:
        bench.send(folder / "box.stl")
        assert add(bench, folder / "tee.stl")[0] == 200
        page.until(lambda state: on_plate(state) == [("tee.stl", 1)])
        page.do("beside", number=1, count=2)
        page.do("turn", axis="z", deg=30)
        state = page.until(lambda state: state["copies_told"] == "All 3 stand on the plate." and state["others"])
        assert drawn(bench, state) == (2 * len(tee().faces), 40.0)
        assert [number for number, _ in state["other_boxes"]] == [0, 0]
        page.do("work_on", number=1)
        page.until(lambda state: (state["model"]["name"], on_plate(state)) == ("tee.stl", [("box.stl", 1)]))
        page.do("add", normal=[0, 0, 1], offset_mm=20.0)
        page.until(lambda state: state["parts"] == 2)
        sliced(page)
        gcode = bench.ask("print.gcode")[1]
        project = folder / "plate.3mf"
        project.write_bytes(bench.ask("project.3mf")[1])
        assert json.loads(bench.ask("settings.json?part=0")[1])["command"] == "tiltprint export box.3mf -o box.gcode"
        assert main(["export", "plate.3mf", "-o", "again.gcode"]) == 0
        assert (folder / "again.gcode").read_bytes() == gcode
        page.do("work_on", number=1)
        page.until(lambda state: on_plate(state) == [("tee.stl", 2)] and not state["sliced"]["stale"])
        assert main(["export", "plate.3mf", "--copies", "2", "-o", "again.gcode"]) == 1
        assert "plate.3mf says how many of each model stand on its plate" in capsys.readouterr().err
        page.do("compare")
        page.until(lambda state: len(state["compared"]) > 1)
        bench.send(folder / "tee.stl")
        page.until(lambda state: state["model"]["name"] == "tee.stl" and on_plate(state) == [])
        assert json.loads(bench.ask("kept")[1])[0]["name"] == "box.stl, tee.stl"
        bench.send(project)
        page.until(lambda state: (state["parts"], on_plate(state)) == (2, [("box.stl", 1)]))  # the tee was worked on
        sliced(page)
        assert bench.ask("print.gcode")[1] == gcode
        assert main(["save", "plate.3mf", "-o", "saved.3mf"]) == 0
        bench.send(folder / "saved.3mf")
        page.until(lambda state: on_plate(state) == [("tee.stl", 2)] and state["beside"][0]["parts"] == 2)


def test_parts_are_found_for_all_models_on_the_plate_that_are_not_cut(bench: Running, folder: Path) -> None:
    with bench.line() as page:
        bench.send(folder / "box.stl")
        add(bench, folder / "tee.stl")
        page.until(lambda state: on_plate(state) == [("tee.stl", 1)] and not state["beside"][0]["parts"])
        page.do("search")
        page.until(lambda state: state["parts"] and state["beside"][0]["parts"])
        page.do("work_on", number=1)
        found = page.until(lambda state: state["model"]["name"] == "tee.stl" and state["standing"])
        assert found["standing"]["size_mm"][2] == pytest.approx(10.0)  # on its front, without overhangs
        assert found["front"][0]["parts"] == 1
        page.do("undo")
        page.do("undo")
        page.until(lambda state: not state["parts"] and not state["beside"][0]["parts"])


def test_a_project_of_an_older_version_opens_with_its_other_models_uncut(folder: Path) -> None:
    names: tuple[None, ...] = (None, None, None)
    plate = ModelRequest("tee.stl", load(), profile_names=names, parts=1, orient=False, beside=("box.stl", "box.stl"))
    assert save(plate, folder / "new.3mf") == 0
    with ZipFile("new.3mf") as new, ZipFile("old.3mf", "w") as old:
        for name in new.namelist():
            content = new.read(name)
            if name.endswith("/work.json"):
                record = json.loads(content)
                record |= {"version": 2, "beside": [[each["name"], each["model"], each["copies"]] for each in record["beside"]]}
                content = json.dumps(record).encode()
            if not name.endswith("/plan-2.toml"):
                old.writestr(name, content)
    (folder / "open").mkdir()
    (other,) = unpack(folder / "old.3mf", folder / "open").beside
    assert (other.name, other.copies, other.parts, other.plan) == ("box.stl", 2, 0, None)
    for name in ("new", "old"):
        assert main(["export", f"{name}.3mf", "-o", f"{name}.gcode"]) == 0
    assert (folder / "old.gcode").read_bytes() == (folder / "new.gcode").read_bytes()


def test_a_model_opened_over_another_one_can_be_added_to_its_plate_instead(bench: Running, folder: Path) -> None:
    with bench.line() as page:
        bench.send(folder / "tee.stl")
        page.do("add", normal=[0, 0, 1], offset_mm=20.0)
        page.until(lambda state: state["parts"] == 2)
        bench.send(folder / "box.stl")
        page.until(lambda state: state["addable"] == "box.stl")
        page.do("add_opened")
        state = page.until(lambda state: on_plate(state) == [("box.stl", 1)])
        assert (state["model"]["name"], state["parts"], state["addable"]) == ("tee.stl", 2, "")
        page.do("add_opened")
        assert page.until(lambda state: state["problem"])["problem"].startswith("no model has just been opened over another")
        page.do("set", key="process.scale", value="2")
        state = page.until(lambda state: state["scale"] == 2.0 and on_plate(state) == [("box.stl", 1)] and state["standing"])
        assert state["undo"] == "scale all models on the plate"
        page.do("beside", number=1, count=900)
        told = page.until(lambda state: state["copies_told"].startswith("box.stl measures 16.0 x 16.0 mm"))["copies_told"]
        assert "no room for it" in told
        assert told.endswith(". The models without a place are drawn in red.")
        assert page.state["unsliceable"].startswith("box.stl measures 16.0 x 16.0 mm")
        assert (page.state["misplaced"], len(page.state["copies_mm"])) == (True, 1)
        assert drawn(bench, page.state)[0] == 900 * 12
        page.do("slice")  # refused at once
        page.until(lambda state: state["problem"] == state["unsliceable"] and not state["slicing"])
        page.do("undo")
        page.until(lambda state: state["copies_told"] == "All 2 stand on the plate.")


def test_a_file_that_is_a_plate_is_not_added_to_one(bench: Running, folder: Path) -> None:
    (folder / "print.gcode").write_text("G28\n")
    with bench.line() as page:
        bench.send(folder / "tee.stl")
        assert add(bench, folder / "print.gcode")[0] == 422
        assert page.until(lambda state: state["problem"])["problem"].startswith("print.gcode is a plate of its own")
        assert add(bench, folder / "tee.stl")[0] == 422
        assert page.until(lambda state: state["problem"].startswith("tee.stl is on the plate already"))
