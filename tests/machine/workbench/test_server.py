"""The workbench as a process: the clients it answers, from a file to its plan and parts, and the end of all its processes."""

import io
import json
import signal
import socket
import time
import zipfile
from pathlib import Path
from shlex import split
from typing import Any

import manifold3d as m3
import numpy as np
import pytest
from PIL import Image
from websockets.exceptions import InvalidStatus

from machine.cli.cli import main
from mdp.save import stl
from tests.machine.running_workbench import PATIENCE_S, QUICK, Running, is_there, workbench
from tests.mdp.slicer_files import AT_ORIGIN, Made, Object, prusaslicer
from tests.shapes import box, tee

FOUND = ("front", "recommended", "cuts")


def test_the_page_is_below_the_token_alone_and_keeps_to_itself(bench: Running) -> None:
    assert bench.ask("")[0] == 200
    assert bench.ask("/")[0] == 404
    assert bench.ask("/nobody/line")[0] == 404
    assert bench.ask("", Host="evil.example")[0] == 403
    assert bench.ask("", Origin="http://evil.example")[0] == 403


def test_a_file_from_another_origin_is_not_taken(bench: Running) -> None:
    assert bench.ask("file?name=a.stl", "POST", b"solid")[0] == 403
    assert bench.ask("file?name=a.stl", "POST", b"solid", Origin="http://evil.example")[0] == 403


@pytest.mark.parametrize(("origin", "path"), [("http://evil.example", None), (None, "/nobody/")])
def test_a_line_from_another_origin_or_without_the_token_is_refused(bench: Running, origin: str | None, path: str | None) -> None:
    with pytest.raises(InvalidStatus) as refused, bench.line(origin, path):
        pass
    assert refused.value.response.status_code == 403


def test_a_request_for_a_model_no_longer_on_the_bench_is_not_an_error(bench: Running) -> None:
    assert bench.ask("model/another") == (204, b"")


def test_a_key_with_only_decimal_digits_is_valid(bench: Running) -> None:
    assert bench.ask("model/1234567890123456") == (204, b"")
    assert bench.ask(f"model/{'9' * 5000}")[0] == 404


def test_a_broken_model_is_reported_as_on_the_command_line(
    bench: Running, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = folder / "broken.stl"
    broken.write_bytes(stl(tee())[:400])
    assert main(["decompose", "broken.stl"]) == 1
    sentence = capsys.readouterr().err.splitlines()[-1].removeprefix("tiltprint: ")
    with bench.line() as page:
        status, _ = bench.send(broken)
        assert status == 422
        assert page.until(lambda state: state["problem"])["problem"] == sentence


def test_an_unknown_command_is_reported_and_closes_no_connection(bench: Running) -> None:
    with bench.line() as page:
        for text in ("", "[]", "{", '"undo"', "[" * 50_000):
            page.say(text)
        page.until(lambda state: "not a command of the workbench" in state["problem"])
        page.do("demo", name="/etc/passwd")
        page.until(lambda state: state["problem"].startswith("/etc/passwd: only the models that ship"))


def test_a_model_becomes_the_plan_and_the_parts_of_the_command_line(bench: Running, folder: Path) -> None:
    model = folder / "tee.stl"
    model.write_bytes(stl(tee()))
    assert main(["decompose", "tee.stl", *QUICK, "--as-is", "-o", "parts"]) == 0
    with bench.line() as page:
        assert bench.send(model)[0] == 200
        page.until(lambda state: state["model"] and state["model"]["name"] == "tee.stl")
        page.do("search", orient=False)
        searched = page.until(lambda state: state["undo"] == "find parts" and not state["search"])
        assert searched["parts"] == searched["recommended"]
    assert bench.ask("plan.toml")[1] == (folder / "parts" / "plan.toml").read_bytes()
    archive = zipfile.ZipFile(io.BytesIO(bench.ask("parts.zip")[1]))
    assert sorted(archive.namelist()) == sorted(path.name for path in (folder / "parts").iterdir() if path.suffix != ".json")
    assert all(archive.read(name) == (folder / "parts" / name).read_bytes() for name in archive.namelist())
    pictures = ["--png", "parts.png", "--sheet", "order.png", "--front", "front.png"]
    assert main(["decompose", "tee.stl", *QUICK, "--plan", "parts/plan.toml", *pictures]) == 0
    drawn = zipfile.ZipFile(io.BytesIO(bench.ask("pictures.zip")[1]))
    assert {name: drawn.read(name) for name in drawn.namelist()} == {
        name: (folder / name).read_bytes() for name in pictures[1::2]
    }
    with bench.line() as page:
        page.do("take", parts=1)
        page.until(lambda state: state["parts"] == 1)
        page.do("turn", axis="x", deg=90)
        page.until(lambda state: not state["front"])
        page.do("undo")
        page.do("undo")
        assert page.until(lambda state: state["parts"] == searched["parts"])["front"] == searched["front"]


def test_a_project_that_a_bench_saves_is_cut_by_the_command_line_and_opened_as_it_was(bench: Running, folder: Path) -> None:
    (folder / "tee.stl").write_bytes(stl(tee()))
    with bench.line() as page:
        assert bench.send(folder / "tee.stl")[0] == 200
        page.until(lambda state: state["undo"] == "open tee.stl")
        page.do("search", orient=False)
        searched = page.until(lambda state: state["undo"] == "find parts" and not state["search"])
        (folder / "saved.3mf").write_bytes(bench.ask("project.3mf")[1])
        page.do("demo", name="demo:bracket")
        page.until(lambda state: state["model"]["name"] == "demo:bracket")
        assert bench.send(folder / "saved.3mf")[0] == 200
        again = page.until(lambda state: state["model"]["name"] == "tee.stl" and state["parts"] == searched["parts"])
        assert [row["planes"] for row in again["front"]] == [row["planes"] for row in searched["front"]]
    assert main(["decompose", "saved.3mf", "-o", "again"]) == 0
    assert bench.ask("plan.toml")[1] == (folder / "again" / "plan.toml").read_bytes()


def test_marks_of_a_slicer_file_are_there_when_it_is_saved_and_opened(bench: Running, folder: Path) -> None:
    post = m3.Manifold.cube((8.0, 10.0, 12.0), True).translate((0.0, 0.0, 6.0))
    near = m3.Manifold.cube((20.0, 20.0, 4.0), True).translate((0.0, 0.0, 8.0))
    prusaslicer(folder / "post.3mf", [Object([Made(post), Made(near, "no_support")], [AT_ORIGIN])])
    assert main(["save", "post.3mf", *QUICK, "--parts", "1", "--as-is", "-o", "kept.3mf"]) == 0
    with bench.line() as page:
        assert bench.send(folder / "kept.3mf")[0] == 200
        opened = page.until(lambda state: state["model"]["name"] == "post.3mf" and state["parts"] == 1)
        assert [zone["kind"] for zone in opened["zones"]] == ["no_support"]


def test_a_model_is_laid_down_with_its_parts_as_the_command_line_does_it(bench: Running, folder: Path) -> None:
    (folder / "tee.stl").write_bytes(stl(tee()))
    assert main(["decompose", "tee.stl", *QUICK, "--set=search.seam_mm=100", "--ranker", "learned", "-o", "parts"]) == 0
    with bench.line() as page:
        page.do("set", key="search.seam_mm", value="100")  # too expensive to cut
        page.until(lambda state: state["undo"] == "set Width of a seam's blemish" and not state["busy"])
        bench.send(folder / "tee.stl")
        page.do("search", ranker="none")
        assert "Search ranking none: classic, learned or the name of" in page.until(lambda state: state["problem"])["problem"]
        page.do("search", orient=False)
        as_it_lies = page.until(lambda state: state["undo"] == "find parts" and not state["search"])
        assert not any("oriented" in note["text"] for note in as_it_lies["notes"])
        page.do("search", ranker="learned")
        laid = page.until(lambda state: state["rotation"] != as_it_lies["rotation"] and not state["search"])
        (told,) = (note["text"] for note in laid["notes"] if "oriented" in note["text"])
        assert told.startswith("oriented on its front (turned 90 about x): in one piece with 0 mm² of visible marks")
        assert told.endswith("; to keep the file's: Undo, then clear “Also choose the best orientation” and find parts again")
        assert laid["front"][0]["support_area_mm2"] < as_it_lies["front"][0]["support_area_mm2"]
        assert bench.ask("plan.toml")[1] == (folder / "parts" / "plan.toml").read_bytes()
        page.do("undo")
        page.until(lambda state: state["rotation"] == as_it_lies["rotation"] and state["front"] == as_it_lies["front"])
        page.do("set", key="search.seam_mm", value="0.8")
        page.until(
            lambda state: state["undo"] == "set Width of a seam's blemish" and not state["busy"]
        )  # the next test shares this bench


@pytest.mark.parametrize("kept", ["turned", "locked", "marked", "set"])
def test_a_search_keeps_the_orientation_of_a_model_that_was_turned_locked_or_marked(
    bench: Running, folder: Path, kept: str
) -> None:
    (folder / "tee.stl").write_bytes(stl(tee()))
    with bench.line() as page:
        bench.send(folder / "tee.stl")
        if kept == "turned":
            page.do("turn", axis="z", deg=30)
        elif kept == "set":
            page.do("set", key="search.objective", value="risky")
        elif kept == "marked":
            page.do("mark", kind="no_seam", min_mm=[-5, -5, 0], max_mm=[5, 5, 2])
        else:
            page.do("add", normal=[1, 0, 0], offset_mm=8.0)
            page.until(lambda state: state["undo"] == "add a plane")
            page.do("lock", part=2, locked=True)
        words = {
            "turned": "turn the model",
            "set": "set Objective",
            "marked": "mark: no seam here",
            "locked": "lock a plane",
        }
        before = page.until(lambda state: state["undo"] == words[kept])
        page.do("search")
        found = page.until(lambda state: state["undo"] == "find parts" and not state["search"])
        assert found["rotation"] == before["rotation"]
        if kept == "set":
            page.do("set", key="search.objective", value="scar")
            page.until(lambda state: state["undo"] != "find parts" and not state["busy"])


def test_the_best_of_a_search_that_is_stopped_is_what_the_command_line_cuts_by_its_plan(bench: Running, folder: Path) -> None:
    with bench.line() as page:
        page.do("demo", name="demo:tree")
        page.until(lambda state: state["model"] and state["model"]["name"] == "demo:tree")
        page.do("search")
        page.until(lambda state: state["search"] and state["search"]["planes"])
        page.do("stop")
        taken = page.until(lambda state: state["undo"] == "stop the search")
        assert [row["time_s"] for row in taken["front"]] == [None]
        (priced,) = page.until(lambda state: state["front"][0]["time_s"])["front"]
    (folder / "plan.toml").write_bytes(bench.ask("plan.toml")[1])
    assert main(["decompose", "demo:tree", *QUICK, "--plan", "plan.toml", "--json", "cut.json"]) == 0
    (cut,) = json.loads((folder / "cut.json").read_text())["front"]
    figures = ("parts", "seam_mm", "support_area_mm2", "time_s", "filament_mm")
    assert {name: priced[name] for name in figures} == {name: cut[name] for name in figures}


def test_a_demo_that_comes_with_a_plan_is_cut_by_it(bench: Running) -> None:
    with bench.line() as page:
        page.do("demo", name="demo:calibration")
        assert page.until(lambda state: state["undo"] == "open calibration.toml")["parts"] == 5


def test_a_plan_that_is_dropped_cuts_the_model_and_one_of_another_model_is_refused(bench: Running, folder: Path) -> None:
    (folder / "other.stl").write_bytes(stl(tee(8.0)))
    assert main(["decompose", "other.stl", *QUICK, "--as-is", "--plan", "plan.toml"]) == 0
    (folder / "tee.stl").write_bytes(stl(tee()))
    with bench.line() as page:
        bench.send(folder / "tee.stl")
        assert bench.send(folder / "plan.toml")[0] == 422
        assert "plan plan.toml was made for another model" in page.until(lambda state: state["problem"])["problem"]
        bench.send(folder / "other.stl")
        assert bench.send(folder / "plan.toml")[0] == 200
        assert page.until(lambda state: state["parts"])["undo"] == "open plan.toml"
    assert bench.ask("plan.toml")[1] == (folder / "plan.toml").read_bytes()


def test_a_plane_is_tried_moved_and_locked_and_a_search_finds_the_others(bench: Running, folder: Path) -> None:
    (folder / "tee.stl").write_bytes(stl(tee()))
    arm = {"normal": [1, 0, 0], "offset_mm": 8.0}
    with bench.line() as page:
        bench.send(folder / "tee.stl")
        page.do("add", **arm)
        page.until(lambda state: state["undo"] == "add a plane" and state["trial"])
        page.do("try", part=2, normal=[1, 0, 0], offset_mm=30.0)
        tried = page.until(lambda state: state["trial"] and state["trial"]["refused"])
        assert "misses the model" in tried["trial"]["refused"]
        assert tried["cuts"] == [{"normal": [1.0, 0.0, 0.0], "offset_mm": 8.0}]
        page.do("move", part=2, normal=[1, 0, 0], offset_mm=30.0)
        refused = page.until(lambda state: state["problem"])
        assert refused["problem"].startswith("part 2 cannot be cut off: its plane misses the model")
        page.do("move", part=2, normal=[1, 0, 0], offset_mm=9.5)
        page.do("lock", part=2, locked=True)  # while the move is in progress
        page.until(lambda state: state["locked"] == [True])
        page.do("search")
        searched = page.until(lambda state: state["undo"] == "find parts" and not state["search"])
        assert (searched["cuts"][-1], searched["locked"][-1]) == ({"normal": [1.0, 0.0, 0.0], "offset_mm": 9.5}, True)
        assert searched["parts"] > 2
    (folder / "plan.toml").write_bytes(bench.ask("plan.toml")[1])
    assert main(["decompose", "tee.stl", *QUICK, "--plan", "plan.toml", "-o", "parts"]) == 0
    archive = zipfile.ZipFile(io.BytesIO(bench.ask("parts.zip")[1]))
    names = [name for name in archive.namelist() if name.endswith(".stl")]
    assert len(names) == searched["parts"]
    assert all(archive.read(name) == (folder / "parts" / name).read_bytes() for name in names)


def test_slices_are_the_g_code_of_the_command_line_and_are_out_of_date_when_the_model_turns(bench: Running, folder: Path) -> None:
    (folder / "tee.stl").write_bytes(stl(tee()))
    assert bench.ask("print.gcode")[0] == 422
    with bench.line() as page:
        bench.send(folder / "tee.stl")
        page.do("add", normal=[1, 0, 0], offset_mm=8.0, ask="added to be sliced")
        page.until(lambda state: "added to be sliced" in state["answers"])
        page.do("slice")
        sliced = page.until(lambda state: state["sliced"] and not state["slicing"])["sliced"]
        (folder / "plan.toml").write_bytes(bench.ask("plan.toml")[1])
        export = ["export", "tee.stl", *QUICK, "--plan", "plan.toml", "-o", "tee.gcode", "--compare", "--html", "tee.html"]
        assert main(export) == 0
        assert bench.ask("print.gcode")[1] == (folder / "tee.gcode").read_bytes()
        assert bench.ask(f"print/{sliced['key']}")[1] == bench.ask("print.html")[1] != (folder / "tee.html").read_bytes()
        assert bench.ask(f"print/{sliced['key']}/text")[1] == bench.ask("print.gcode")[1]
        direction = np.frombuffer(bench.ask(f"walls/{sliced['number']}/2")[1], "<f4", 3)
        ((part, _, contact, *_),) = sliced["joints"]
        assert (part, float(contact.removesuffix(" %")) > 90.0) == ("2", True)
        assert (sliced["ready"], direction.tolist()) == ([1, 2], [1.0, 0.0, 0.0])
        page.do("compare")
        parts, upright, _ = page.until(lambda state: state["compared"])["compared"]
        ours, other = dict(parts["figures"]), dict(upright["figures"])
        assert (parts["name"], ours["findings"]) == ("in 2 parts", f"{len(sliced['findings'])}")
        assert float(other["support"].split()[0]) > float(ours["support"].split()[0])
        assert (ours["seams between parts"] != "0 mm", other["seams between parts"]) == (True, "0 mm")
        assert bench.ask("print.html")[1] == (folder / "tee.html").read_bytes()  # with the comparison, as with --compare
        page.do("turn", axis="z", deg=30)
        assert page.until(lambda state: state["sliced"]["stale"])["sliced"]["key"] == sliced["key"]
        assert bench.ask("print.gcode")[0] == 422
        bench.send(folder / "tee.stl")
        assert page.until(lambda state: not state["sliced"])["compared"] == []


def test_marks_on_a_model_in_one_piece_are_in_the_plan_that_its_command_uses(bench: Running, folder: Path) -> None:
    (folder / "box.stl").write_bytes(stl(box(8, 8, 2)))
    with bench.line() as page:
        bench.send(folder / "box.stl")
        page.do("mark", kind="no_seam", min_mm=[-5, 3, 0], max_mm=[5, 5, 2])
        page.until(lambda state: state["zones"])
        page.do("turn", axis="z", deg=30)
        page.until(lambda state: state["zones"] and state["zones"][0]["axes"])
        page.do("slice")
        page.until(lambda state: state["sliced"] and not state["slicing"])
        command = json.loads(bench.ask("settings.json?part=0")[1])["command"]
        assert command.endswith(" --plan box-plan.toml -o box.gcode")
        (folder / "box-plan.toml").write_bytes(bench.ask("plan.toml")[1])
        assert main(split(command)[1:]) == 0
        assert bench.ask("print.gcode")[1] == (folder / "box.gcode").read_bytes()
        bench.send(folder / "box.stl")
        page.until(lambda state: not state["sliced"])


def test_copies_and_pauses_are_the_command_line_s_and_their_sentences_name_fields(bench: Running, folder: Path) -> None:
    (folder / "box.stl").write_bytes(stl(box(8, 8, 4)))
    with bench.line() as page:
        bench.send(folder / "box.stl")
        page.do("copies", count=2)
        page.do("add_stop", kind="filament_change", at="1:3")
        page.do("add_stop", kind="pause", at="1:2.4mm")
        page.do("slice")
        sliced = page.until(lambda state: state["sliced"] and not state["slicing"])
        assert [stop["kind"] for stop in sliced["stops"]] == ["pause", "filament change"]
        command = json.loads(bench.ask("settings.json?part=0")[1])["command"]
        assert command.endswith(" --parts 1 --as-is --copies 2 --pause 1:2.4mm --filament-change 1:3 -o box.gcode")
        assert main(split(command)[1:]) == 0
        gcode = bench.ask("print.gcode")[1]
        assert gcode == (folder / "box.gcode").read_bytes()
        assert b"\nM600" in gcode
        page.do("remove_stop", number=1)
        page.until(lambda state: state["sliced"]["stale"])
        page.do("undo")
        page.until(lambda state: not state["sliced"]["stale"])
        page.do("add_stop", kind="pause", at="2-3")
        assert page.until(lambda state: state["problem"])["problem"].startswith(
            "2-3 under Copies and pauses: PART:LAYER or PART:HEIGHTmm is expected"
        )
        page.do("add_stop", kind="pause", at="9:1")
        sentence = "9:1 under Copies and pauses: there is no part 9, there is only part 1"
        assert page.until(lambda state: state["problem"] == sentence)
        page.do("add_stop", kind="pause", at="1:99999")
        sentence = "1:99999 under Copies and pauses: part 1 is at most 4 mm high and has at most 51 layers"
        assert page.until(lambda state: state["problem"] == sentence)
        page.do("add", normal=[0, 0, 1], offset_mm=2.0)
        page.until(lambda state: state["parts"] == 2 and not state["problem"])
        page.do("slice")
        sentence = "1:2.4mm under Copies and pauses: part 1 is at most 2 mm high"  # both copies are sliced in these parts
        assert page.until(lambda state: state["problem"] == sentence)
        bench.send(folder / "box.stl")
        page.until(lambda state: (state["copies"], state["stops"]) == (1, []))


def test_another_machine_keeps_all_planes_and_reports_those_it_cannot_cut(bench: Running, folder: Path) -> None:
    (folder / "tee.stl").write_bytes(stl(tee()))
    with bench.line() as page:
        bench.send(folder / "tee.stl")
        page.do("add", normal=[1, 0, 0], offset_mm=8.0)
        page.until(lambda state: state["parts"] == 2)
        page.do("add", normal=[0, 0, 1], offset_mm=20.0, after=1)
        page.until(lambda state: state["parts"] == 3)
        page.do("set", key="process.walls", value="400")
        assert "Walls is 400" in page.until(lambda state: state["problem"])["problem"]
        page.do("profile", kind="machine", name="three_axis")
        kept = page.until(lambda state: state["given"]["machine"] == "three_axis" and state["note"])
        assert ([cut["offset_mm"] for cut in kept["cuts"]], kept["problem"]) == ([20.0, 8.0], "")
        assert bench.ask("pieces") == (204, b"")
        assert (page.state["problem"], kept["invalid"][0]) == ("", "")
        assert kept["note"] == f"part 3 cannot be cut off: {kept['invalid'][1]}"
        page.do("undo")
        page.until(lambda state: state["parts"] == 3 and state["given"]["machine"] == "generic_ac")
        page.do("set", key="process.scale", value="2")
        assert page.until(lambda state: state["model"]["size_mm"][0] > 79)["parts"] == 3  # the planes scale with the model
        page.do("undo")


def test_a_machine_sent_as_a_file_keeps_the_settings_that_it_allows_and_names_the_others(bench: Running, folder: Path) -> None:
    (folder / "fine.toml").write_text('inherits = "generic_ac"\n[machine]\nname = "fine"\n[machine.head]\nnozzle_mm = 0.2\n')
    with bench.line() as page:
        for key, value in (("process.walls", "4"), ("process.layer_height_mm", "0.3")):
            page.do("set", key=key, value=value)
        page.until(lambda state: "process.layer_height_mm=0.3" in state["given"]["settings"])
        assert bench.send(folder / "fine.toml")[0] == 200
        state = page.until(lambda state: state["undo"] == "take fine.toml")
        assert "Layer height" in state["note"]
        assert state["note"].endswith("as in the profile, which does not allow your value")
        left = state["given"]["settings"]
        assert ("process.walls=4" in left, "process.layer_height_mm=0.3" in left, state["problem"]) == (True, False, "")
        page.do("undo", count=3)
        page.until(lambda state: "process.walls=4" not in state["given"]["settings"])


def colours_in(picture: bytes) -> set[str]:
    """The colours of the first two parts that are in a picture."""
    pixels = np.array(Image.open(io.BytesIO(picture)).convert("RGBA"), dtype=int).reshape(-1, 4)
    red, _, blue = pixels[pixels[:, 3] > 200, :3].T
    return {name for name, more in (("orange", red - blue), ("blue", blue - red)) if (more > 60).any()}


def test_work_by_hand_is_kept_when_another_model_is_opened_and_can_be_opened_again(bench: Running, folder: Path) -> None:
    (folder / "own.stl").write_bytes(stl(tee()))
    (folder / "next.stl").write_bytes(stl(box(10.0, 10.0, 10.0)))
    origin = f"http://127.0.0.1:{bench.port}"

    def name_of(state: dict[str, Any]) -> str | None:
        return state["model"] and str(state["model"]["name"])

    def kept() -> list[dict[str, Any]]:
        return [work for work in json.loads(bench.ask("kept")[1]) if work["name"] == "own.stl"]

    with bench.line() as page:
        bench.send(folder / "own.stl")
        page.do("search", orient=False)
        searched = page.until(lambda state: name_of(state) == "own.stl" and state["front"] and not state["search"])
        assert searched["recommended"] == 2
        before = page.state["kept"]
        bench.send(folder / "next.stl")  # at once, before the autosave
        opened = page.until(lambda state: name_of(state) == "next.stl")
        assert opened["note"] == "own.stl, cut into 2 parts, is kept under Earlier work (Undo brings it back)"
        assert opened["kept"] > before
        page.do("undo")
        assert page.until(lambda state: name_of(state) == "own.stl")["parts"] == 2
        page.do("redo")
        page.until(lambda state: name_of(state) == "next.stl")
        (work,) = [work for work in kept() if work["parts"] == 2][-1:]
        for _ in range(2):  # drawn, then from the cache
            status, picture = bench.ask(f"kept/{work['key']}/picture")
            assert (status, colours_in(picture)) == (200, {"orange", "blue"})
            assert len(picture) < 20_000
        assert bench.ask("kept/nothing/picture") == (204, b"")  # an error is not reported to a page
        assert bench.ask(f"kept/{work['key']}", "POST", Origin=origin)[0] == 200
        again = page.until(lambda state: name_of(state) == "own.stl")
        assert {key: again[key] for key in FOUND} == {key: searched[key] for key in FOUND}
        bench.send(folder / "next.stl")
        page.until(lambda state: name_of(state) == "next.stl")
        for work in kept():
            assert bench.ask(f"kept/{work['key']}", "DELETE", Origin=origin)[0] == 200
        assert kept() == []
        assert bench.ask("kept/nothing", "DELETE", Origin=origin)[0] == 422


def test_figures_and_stable_orientations_follow_edits_by_hand(bench: Running, folder: Path) -> None:
    (folder / "hand.stl").write_bytes(stl(tee()))
    with bench.line() as page:
        bench.send(folder / "hand.stl")
        page.until(lambda state: state["model"] and state["model"]["name"] == "hand.stl" and state["resting"])
        assert [rest["words"] for rest in page.state["resting"] if rest["present"]] == ["as in the file"]
        page.do("search", orient=False)
        page.until(lambda state: state["front"] and not state["search"] and state["needing_mm2"] is not None)
        whole, cut = page.state["front"]
        assert page.state["needing_mm2"] == whole["support_area_mm2"]  # one number on both tabs
        assert page.state["by_hand"] is None
        (plane,) = page.state["cuts"]
        page.do("move", part=2, normal=plane["normal"], offset_mm=plane["offset_mm"] - 5.0)
        leans = [plane["normal"][0] + 0.1, *plane["normal"][1:]]
        page.do("move", part=2, normal=leans, offset_mm=plane["offset_mm"], near=True)
        page.until(lambda state: state["undo"] == "tilt a plane")
        page.do("undo")
        moved = page.until(lambda state: state["undo"] == "move a plane")
        assert moved["by_hand"] is None  # not known yet, rather than the figures of the previous planes
        by_hand = page.until(lambda state: state["by_hand"])["by_hand"]
        assert (by_hand["parts"], by_hand["planes"]) == (2, moved["cuts"])
        assert by_hand["time_s"] != cut["time_s"]
        page.do("turn", axis="x", deg=30)
        turned = page.until(lambda state: state["undo"] == "turn the model" and state["overhang_mm2"] is not None)
        (present,) = (rest for rest in turned["resting"] if rest["present"])
        assert (present["words"], present["overhang_mm2"]) == ("as it lies now", turned["overhang_mm2"])


def test_pages_that_read_nothing_block_no_other(bench: Running) -> None:
    deaf = []
    for _ in range(10):
        own = socket.create_connection(("127.0.0.1", bench.port))
        own.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1024)
        own.sendall(
            f"GET {bench.place}line HTTP/1.1\r\nHost: 127.0.0.1:{bench.port}\r\nOrigin: http://127.0.0.1:{bench.port}\r\n"
            "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n".encode()
        )
        deaf.append(own)
    with bench.line() as page:
        began = time.monotonic()
        for k in range(200):
            page.do("demo", name=f"{k}{'.' * 50_000}")  # 10 MB for each page, more than all buffers between can hold
        page.until(lambda state: state["problem"].startswith("199."))
        assert time.monotonic() - began < 30.0
    for own in deaf:
        own.close()


def test_ctrl_c_ends_it_within_two_seconds_with_all_it_has_started_even_while_it_searches() -> None:
    assert any(ended_s() < 2.0 for _ in range(3))  # a machine may be busy, but not always


def ended_s() -> float:
    """Seconds from Ctrl-C until a searching workbench and all processes that it has started have ended."""
    with workbench("demo:tree") as running:
        with running.line() as page:
            page.until(lambda state: state["model"])
            page.do("search")
            page.until(lambda state: state["search"])
            started = running.children()
            assert len(started) >= 2
            running.process.send_signal(signal.SIGINT)
            began = time.monotonic()
            assert running.process.wait(PATIENCE_S) == 0
        while any(map(is_there, started)):
            assert time.monotonic() - began < PATIENCE_S
        return time.monotonic() - began


def test_a_missing_resource_is_reported_in_one_sentence(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert main(["edit", "--no-browser", "--port", str(port)]) == 1
    assert f"--port {port} cannot be used: address already in use" in capsys.readouterr().err
    (folder / "plan.toml").write_text('version = 1\nmodel = "gone.stl"\n')
    for model, said in (
        ("none.stl", "there is no such file"),
        ("plan.toml", "gone.stl is not beside it"),
        ("a.gcode", "is G-code"),
    ):
        assert main(["edit", "--no-browser", model]) == 1
        assert said in capsys.readouterr().err
