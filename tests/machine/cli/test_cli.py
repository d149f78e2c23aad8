import errno
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from machine.cli import start
from machine.cli.cli import main
from mdp.save import FOLDER_FILES, stl
from tests import shapes

# A T this small, with high stair-stepping on its arms and small arms compared with their seams, is still cut.
IN_PARTS = ["--as-is", "--set", "search.seam_mm=0.8", "--set", "search.stair_weight=0.01"]
FAST = ["--set", "search.directions=60", "--set", "process.layer_height_mm=0.3", "--set", "process.first_layer_height_mm=0.3"]
FAST += ["--set", "process.line_width_mm=0.6", "--set", "process.scale=0.6", "--set", "process.infill_density=0.05"]
COARSE = ["--set", "search.directions=20", "--set", "process.layer_height_mm=0.4"]

WRONG = [
    (["decompose", "nowhere.stl"], "nowhere.stl"),
    (["decompose", "."], "folder"),
    (["decompose", f"{'long' * 80}.stl"], "there is no such file"),
    (["decompose", "demo:tree", "--machine", "long" * 80], "is not known"),
    (["decompose", "demo:tree", "-o", "long" * 80], "file name too long"),
    (["decompose", "demo:tree", "--json", "long" * 80], "file name too long"),
    (["decompose", "demo:unicorn"], "figure"),
    (["decompose", "demo:tree", "--nonsense"], "--beam-width"),
    (["decompose", ""], "the model's name is empty"),
    (["decompose", "demo:tree", "--machine", "lathe"], "generic_ac"),
    (["decompose", "demo:tree", "--machine", "generic_ca"], "did you mean generic_ac?"),
    (["decompose", "demo:tree", "--material", "PLA"], "did you mean pla?"),
    (["decompose", "demo:tree", "--process", ""], "process profile '' is not known"),
    (["decompose", "demo:tree", "--jsn", "x"], "did you mean --json?"),
    (["decompose", "demo:tree", "--set", "process.wals=2"], "process.wals"),
    (["decompose", "demo:tree", "--set", "process.walls=-2"], "process.walls"),
    (["decompose", "demo:tree", "--set", "walls"], "KEY=VALUE"),
    (["decompose", "demo:tree", "--beam-width", "0"], "beam_width"),
    (["decompose", "demo:tree", "--beam-width", "many"], "--beam-width is 'many': it must be a whole number"),
    (["decompose", "demo:tree", "--beam-width=many"], "--beam-width is 'many': it must be a whole number"),
    (["decompose", "demo:tree", "-o", "-"], "a folder is expected"),
    (["decompose", "demo:tree", "--png", "-"], "output -: a file name is expected"),
    (["export", "demo:tree", "-o", "-", "--json", "-"], "only one of them can go to standard output"),
    (["view", "short.gcode", "-o", "-"], "output -: a file name is expected"),
    (["decompose", "demo:tree", "--search", "luck"], 'search.method is "luck": it must be one of "best", "published"'),
    (["decompose", "demo:tree", "--time-limit", "-1"], "search.time_limit_s is -1"),
    (["decompose", "demo:tree", "--time-limit", "soon"], "--time-limit is 'soon'"),
    (["decompose", "demo:tree", "--ranker", "oracle"], "classic"),
    (["export", "demo:tree", "-o", "/nowhere/x.gcode"], "/nowhere"),
    (["export", "demo:tree", "-o", "."], "folder"),
    (["export", "demo:tree", "-o", "x.gcode", "--layer", "1:1"], "--svg FILE must say where to"),
    (["export", "demo:tree", "-o", "x.gcode", "--svg", "x.svg", "--layer", "two"], "PART:LAYER is expected"),
    (["print", "empty.gcode", "--port", "sim"], "empty.gcode"),
    (["simulate", "rubbish.gcode"], "rubbish.gcode"),
    (["simulate", "demo:tree", "--model", "demo:tree"], "--model demo:tree"),
    (["simulate", "short.gcode", "--model", "nowhere.stl"], "nowhere.stl"),
    (["decompose", "demo:tree", "--parts", "0"], "--parts is 0: 1 to 1000 is allowed"),
    (["decompose", "demo:tree", "--parts", "few"], "--parts is 'few': it must be a whole number"),
    (["decompose", "demo:tree", "--plan", "rubbish.gcode"], "plan rubbish.gcode is not text"),
    (["decompose", "demo:tree", "--plan", "box.toml", "--planes", "box.toml"], "so nothing is searched; one of them is allowed"),
    (["decompose", "demo:tree", "--plan", "box.toml", "--record", "x.npz"], "so nothing is searched that could be recorded"),
    (["decompose", "demo:tree", "--plan", "/nowhere/p.toml"], "the folder /nowhere does not exist"),
    (["decompose", "demo:tree", "--planes", "box.toml", "--orient"], "--orient: the planes of box.toml belong to the model"),
    (["decompose", "demo:tree", "--planes", "none.toml"], "plan none.toml cannot be read: no such file or directory"),
    (["export", "demo:tree", "-o", "x.gcode", "--plan", "none.toml"], "plan none.toml cannot be read: no such file or directory"),
    (["export", "demo:tree", "-o", "x.gcode", "--plan", "long" * 80], "cannot be read: file name too long"),
    (["simulate", "short.gcode", "--plan", "box.toml"], "--plan box.toml: short.gcode is G-code, which is cut already"),
    (["view", "short.gcode", "--parts", "2"], "--parts 2: short.gcode is G-code, which is cut already"),
    (["print", "demo:tree", "--port", "sim", "--plan", "."], "plan . cannot be read: is a directory"),
    (["profiles", "show", "unicorn"], "generic_ac"),
    (["profiles", "check", "nowhere.toml"], "nowhere.toml"),
    (["export", "demo:tree", "-o", "x.gcode", "--part", "walls=4"], "--part walls=4: PART:KEY=VALUE,... is expected"),
    (["export", "demo:tree", "-o", "x.gcode", "--part", "2:walls=-4"], "part 2: process.walls is -4: it must be a whole number"),
    (["export", "demo:tree", "-o", "x.gcode", "--copies", "0"], "--copies is 0: 1 to 1000 is allowed"),
    *(
        (["export", f"demo:tree:{count}", "-o", "x.gcode"], "demo:tree must be a whole number from 1 to 1000")
        for count in ("0", "-1", "2.5", "1001", "")
    ),
    (
        ["export", "demo:tree:1000", "-o", "x.gcode", "--copies", "1000"],
        "1000000 models are to stand on the plate with --copies 1000: 1000 at most are allowed",
    ),
    (["export", "demo:tree:999", "demo:bracket:2", "-o", "x.gcode"], "1001 models are to stand on the plate: 1000 at most"),
    (["export", "demo:tree", "nowhere.stl:2", "-o", "x.gcode"], "nowhere.stl: there is no such file"),
    (
        ["export", "demo:tree", "demo:bracket", "-o", "x.gcode", "--plan", "box.toml"],
        'plan box.toml: model is "": beside other models it must be the name of one of these: demo:tree, demo:bracket',
    ),
    (
        ["export", "demo:tree", "demo:bracket", "-o", "x.gcode", "--part", "1:walls=4"],
        "--part 1 goes with one model, and several are given, demo:tree, demo:bracket: settings of a part of one",
    ),
    (
        ["simulate", "short.gcode", "demo:tree"],
        "short.gcode is G-code, which is a plate of its own: demo:tree cannot go beside it",
    ),
    (["simulate", "short.gcode", "--copies", "2"], "--copies 2: short.gcode is G-code, which is sliced already"),
    (["export", "demo:tree", "-o", "x.gcode", "--pause", "2"], "--pause 2: PART:LAYER or PART:HEIGHTmm is expected"),
    (["simulate", "short.gcode", "--filament-change", "1:2"], "--filament-change 1:2: short.gcode is G-code, which says itself"),
    (["simulate", "short.gcode", "--part", "2:walls=4"], "--part 2: short.gcode is G-code, which is sliced already"),
    (["profiles", "show", "pla", "--set", "process.walls=3"], "pla is a material profile"),
    (["calibrate", "--measured", "nowhere.toml"], "sheet nowhere.toml cannot be read"),
    (["print", "demo:tree"], "--port PORT|sim is missing: serial port or print server; sim: the simulated printer; see"),
    (["save", "demo:tree"], "--out NAME.3mf is missing: project file to write; see tiltprint save --help"),
    (["export"], "MODEL is missing: STL, OBJ"),
    (["profiles"], "a command of tiltprint profiles is expected: list, show, save, import, detect, check"),
    (["decompose", "demo:tree", "demo:box"], "unexpected argument demo:box; see tiltprint decompose --help"),
    (["fly"], "decompose"),
    (["exprot"], "did you mean export?"),
    (["slice", "model.stl"], "command slice is not known (did you mean export?)"),
    (["print", "demo:tree", "--port", "/dev/nowhere"], "/dev/nowhere does not exist"),
    (["print", "demo:tree", "--port", "/dev/null"], "/dev/null"),
    (["print", "demo:tree", "--port", "sim", "--sim-speed", "-1"], "--sim-speed is -1"),
    (["print", "short.gcode", "--port", "sim", "--baud", "0"], "baud rate 0 is not possible"),
    (["print", "short.gcode", "--port", "sim", "--watch-port", "70000"], "--watch-port is '70000': it must be at most 65535"),
    (["decompose", "-lead.stl"], "./-lead.stl"),
    (["decompose", "demo:tree", "--json", "empty.gcode/x.json"], "empty.gcode is a file"),
    (["decompose", "demo:tree", "-o", "empty.gcode/parts"], "empty.gcode is a file"),
]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty.gcode").write_text("")
    (tmp_path / "short.gcode").write_text("G28\nG1 Z5 F600\n")
    (tmp_path / "box.toml").write_text("version = 1\n[[part]]\n[[part]]\nnormal = [0, 0, 1]\noffset_mm = 500\n")
    (tmp_path / "-lead.stl").write_text("solid")
    (tmp_path / "rubbish.gcode").write_bytes(bytes(range(256)))
    return tmp_path


@pytest.mark.parametrize(("arguments", "named"), WRONG, ids=lambda value: " ".join(value) if isinstance(value, list) else value)
def test_wrong_input_is_one_sentence_naming_what_is_allowed(
    folder: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], named: str
) -> None:
    before = sorted(folder.iterdir())
    assert main(arguments) == 1
    message = capsys.readouterr().err
    assert named in message
    assert message.startswith("tiltprint: ")
    assert message.count("\n") == 1
    assert sorted(folder.iterdir()) == before


def test_a_bug_ends_with_exit_3_and_a_log_file(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def broken() -> int:
        raise ZeroDivisionError("planted")

    monkeypatch.setattr("machine.cli.commands.profiles.listing.list_profiles", broken)
    assert main(["profiles", "list"]) == 3
    log = Path(capsys.readouterr().err.strip().rsplit(" ", 1)[1])
    assert "ZeroDivisionError: planted" in log.read_text()
    log.unlink()


def test_a_full_disk_under_standard_output_is_no_bug(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def full() -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("machine.cli.commands.profiles.listing.list_profiles", full)
    assert main(["profiles", "list"]) == 1
    assert capsys.readouterr().err == "tiltprint: a file cannot be written: no space is left\n"
    monkeypatch.setattr("sys.stdout", SimpleNamespace(flush=full))
    assert main(["profiles", "list"]) == 1
    assert capsys.readouterr().err == "tiltprint: standard output cannot be written: no space is left\n"


def test_ctrl_c_before_the_command_line_is_loaded_is_an_interrupt(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted() -> int:
        raise KeyboardInterrupt

    left: list[int] = []
    monkeypatch.setattr("machine.cli.cli.main", interrupted)
    monkeypatch.setattr("machine.cli.terminal.interrupts.leave", left.append)
    before = signal.getsignal(signal.SIGINT)
    start.main()
    signal.signal(signal.SIGINT, before)
    assert left == [130]


def test_ctrl_c_beneath_compiled_code_is_an_interrupt(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted() -> int:
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as beneath:
            raise SystemError("returned a result with an exception set") from beneath

    monkeypatch.setattr("machine.cli.commands.profiles.listing.list_profiles", interrupted)
    assert main(["profiles", "list"]) == 130


def test_decompose_writes_what_the_contract_names(folder: Path) -> None:
    wanted = ["-o", "parts", "--json", "out.json", "--png", "parts.png", "--sheet", "sheet.png", "--front", "front.png"]
    Path("tee.stl").write_bytes(stl(shapes.tee()))
    assert main(["decompose", "tee.stl", *IN_PARTS, *FAST, *wanted]) == 0
    record = json.loads(Path("out.json").read_text())
    assert set(record) == {
        "model", "faces", "beam_width", "ranker", "seconds", "risky_area_mm2", "residual_area_mm2", "reduction", "volume_mm3",
        "candidates_evaluated", "rounds", "parts", "cost_mm2", "seam_mm", "stairs_mm2", "rotate_deg", "joints", "front",
    }  # fmt: skip
    assert set(record["parts"][0]) == {
        "index", "direction", "base", "tilt_deg", "turn_deg", "volume_mm3", "risky_area_mm2", "feather_share", "faces", "file",
    }  # fmt: skip
    assert len(record["parts"]) > 1
    assert sum(part["volume_mm3"] for part in record["parts"]) == pytest.approx(record["volume_mm3"], rel=1e-6)
    files = {part["file"] for part in record["parts"]} | set(FOLDER_FILES)
    assert {file.name for file in Path("parts").iterdir()} == files
    assert all(Path(name).read_bytes().startswith(b"\x89PNG") for name in ("parts.png", "sheet.png", "front.png"))


def test_decompose_compares_the_sliced_parts_with_one_piece_and_reports_their_joint_contact(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("tee.stl").write_bytes(stl(shapes.tee()))
    given = ["tee.stl", *IN_PARTS, *FAST, "--json", "out.json"]
    assert main(["decompose", *given]) == 0
    (joint,) = json.loads(Path("out.json").read_text())["joints"]
    assert (joint["contact_share"], joint["plastic_over_room"]) == (None, None)
    assert "contact %" not in capsys.readouterr().out
    assert main(["decompose", *given, "--compare", "--html", "out.html"]) == 0
    record = json.loads(Path("out.json").read_text())
    assert [way["name"] for way in record["compare"]] == ["parts", "upright", "oriented"]
    assert record["joints"] == record["compare"][0]["joints"]
    sliced = record["joints"][0]
    assert {key: sliced[key] for key in joint if joint[key] is not None} == {k: v for k, v in joint.items() if v is not None}
    row = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("2 ") and " 0.0" not in line)
    assert row.split()[1:4] == [
        f"{sliced['area_mm2']:.1f}",
        f"{100 * sliced['contact_share']:.1f}",
        f"{100 * sliced['plastic_over_room']:.0f}",
    ]


def test_options_of_the_search_are_its_profile_keys(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("tee.stl").write_bytes(stl(shapes.tee()))
    assert main(["decompose", "tee.stl", *FAST, "--search", "published", "--beam-width", "3", "--json", "a.json"]) == 0
    words = ["--set", "search.method=published", "--set", "search.beam_width=3"]
    assert main(["decompose", "tee.stl", *FAST, *words, "--json", "b.json"]) == 0
    first, again = (json.loads(Path(name).read_text()) for name in ("a.json", "b.json"))
    assert {**first, "seconds": None} == {**again, "seconds": None}


@pytest.mark.parametrize("command", [["decompose"], ["export", "-o", "a.gcode"]])
def test_a_zero_time_limit_prints_one_part_and_reports_it(
    folder: Path, capsys: pytest.CaptureFixture[str], command: list[str]
) -> None:
    Path("tee.stl").write_bytes(stl(shapes.tee()))
    assert main([*command, "tee.stl", "--as-is", *FAST, "--set", "process.support=none", "--time-limit", "0"]) == 0
    assert "search.time_limit_s = 0 ended the search" in capsys.readouterr().err


def test_export_twice_gives_the_same_bytes_and_a_file_that_simulates(folder: Path) -> None:
    Path("tee.stl").write_bytes(stl(shapes.tee()))
    for name in ("a.gcode", "b.gcode"):
        assert main(["export", "tee.stl", *FAST, "-o", name, "--json", "a.json"]) == 0
    assert Path("a.gcode").read_bytes() == Path("b.gcode").read_bytes()
    assert main(["simulate", "a.gcode", *FAST, "--json", "again.json"]) == 0
    first, again = (json.loads(Path(name).read_text()) for name in ("a.json", "again.json"))
    assert set(first) == {
        "time_s", "filament_mm", "extruded_mm3", "travel_mm", "layers", "parts", "reorientations", "retractions", "bounds_mm",
        "axes", "interfaces", "findings",
    }  # fmt: skip
    assert first == again


def test_several_models_are_exported_as_one_plate_and_a_number_gives_the_copies(folder: Path) -> None:
    Path("large.stl").write_bytes(stl(shapes.box(30, 20, 2)))
    Path("small.stl").write_bytes(stl(shapes.box(10, 10, 1)))
    plate = ["--as-is", *FAST, "--set", "process.skirt_loops=0"]
    assert main(["export", "large.stl", "small.stl:2", *plate, "-o", "a.gcode", "--json", "a.json"]) == 0
    assert main(["export", "large.stl", "small.stl", "small.stl", *plate, "-o", "b.gcode"]) == 0
    assert Path("a.gcode").read_bytes() == Path("b.gcode").read_bytes()
    figures = json.loads(Path("a.json").read_text())
    assert (figures["parts"], [finding["code"] for finding in figures["findings"]]) == (1, ["uncalibrated"])
    assert np.ptp(figures["bounds_mm"], axis=0)[1] == pytest.approx(0.6 * (10 + 20 + 10) + 2 * 5, abs=0.7)  # less one line width
    assert main(["simulate", "large.stl", "small.stl:2", *plate, "--json", "model.json"]) == 0
    assert json.loads(Path("model.json").read_text())["model"]["outside"] == 0.0


@pytest.mark.parametrize("turned", [["--set", "process.rotate_deg=[0, 30, 20]", "--orient"], ["--as-is"]])
def test_the_plastic_of_a_file_is_held_against_its_model_however_it_was_laid_down(folder: Path, turned: list[str]) -> None:
    Path("tee.stl").write_bytes(stl(shapes.tee()))
    assert main(["export", "tee.stl", *FAST, *turned, "-o", "a.gcode"]) == 0
    assert ("; process.rotate_deg = [0.0, 0.0, 0.0]" in Path("a.gcode").read_text()) == ("--as-is" in turned)
    assert main(["simulate", "a.gcode", "--model", "tee.stl", "--json", "beside.json"]) == 0
    beside = json.loads(Path("beside.json").read_text())["model"]
    assert (beside["outside"], beside["filled"] > 0.5) == (0.0, True)


def test_g_code_on_standard_output_is_the_file_alone(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("box.stl").write_bytes(stl(shapes.box(20, 20, 2)))
    assert main(["export", "box.stl", "--as-is", *FAST, "-o", "a.gcode"]) == 0
    table = capsys.readouterr().out
    assert main(["export", "box.stl", "--as-is", *FAST, "-o", "-"]) == 0
    output = capsys.readouterr()
    assert (output.out, table.partition("wrote a.gcode: ")[0] in output.err) == (Path("a.gcode").read_text(), True)
    assert output.err.endswith("\nready to print, 1 warning\n")
    assert not Path("-").exists()


def test_every_command_is_described_in_one_line_of_a_narrow_screen(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["--help"]) == 0
    lines = capsys.readouterr().out.partition("Commands:")[2].splitlines()[1:]
    assert len(lines) == 17
    assert all(line.endswith(".") and not line.endswith("...") for line in lines)


def test_the_simulated_speed_must_be_a_number(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("one.gcode").write_text("G28\nM104 S0\nM140 S0\n")
    assert main(["print", "one.gcode", "--port", "sim", "--sim-speed", "nan"]) == 1
    assert "--sim-speed is nan" in capsys.readouterr().err


def test_a_byte_order_mark_is_read_over(folder: Path) -> None:
    Path("mark.gcode").write_bytes(b"\xef\xbb\xbfG28\nM104 S0\nM140 S0\n")
    assert main(["simulate", "mark.gcode"]) == 0


def test_simulate_ends_with_its_files_and_a_verdict(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("still.gcode").write_text("; a remark\n")
    assert main(["simulate", "still.gcode", "--json", "still.json"]) == 0
    assert capsys.readouterr().out.endswith("wrote still.json: nothing to print\n")
    assert main(["simulate", "short.gcode"]) == 0
    assert capsys.readouterr().out.endswith("\nready to print, 1 warning\n")


def test_a_model_that_does_better_lying_down_is_laid_down(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("tee.stl").write_bytes(stl(shapes.tee()))
    turned, told = [], []
    for arguments in (["--as-is"], [], ["--orient"]):
        assert main(["decompose", "tee.stl", *arguments, *COARSE, "--json", "out.json"]) == 0
        out = json.loads(Path("out.json").read_text())
        turned.append(out["rotate_deg"])
        told.append("tee.stl: oriented on its front (turned 90 about x): in one piece" in capsys.readouterr().err)
    assert turned == [[0.0, 0.0, 0.0], [90.0, 0.0, 0.0], [90.0, 0.0, 0.0]]
    assert told == [False, True, True]
    assert (out["parts"][0]["direction"], out["residual_area_mm2"]) == ([0.0, 0.0, 1.0], pytest.approx(0.0, abs=1e-6))


def test_a_plan_that_lays_the_model_down_does_not_go_with_keeping_it(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("tee.stl").write_bytes(stl(shapes.tee()))
    Path("tee.toml").write_text("version = 1\norientation = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]\n")
    assert main(["decompose", "tee.stl", "--plan", "tee.toml", "--json", "out.json"]) == 0
    assert json.loads(Path("out.json").read_text())["rotate_deg"] == [90.0, 0.0, 0.0]
    assert main(["decompose", "tee.stl", "--plan", "tee.toml", "--as-is"]) == 1
    assert "--as-is: the plan tee.toml gives the model's orientation" in capsys.readouterr().err


STAYS = [
    ["--set", "process.rotate_deg=[0, 0, 30]"],
    ["--set", "search.seam_mm=0"],
    ["--set", "search.objective=risky"],
    ["--planes", "planes.toml"],
]


@pytest.mark.parametrize(
    "arguments", STAYS, ids=["turned by the profile", "seams that cost nothing", "the paper's terms", "planes by hand"]
)
def test_a_model_is_not_reoriented_if_an_option_sets_its_orientation(folder: Path, arguments: list[str]) -> None:
    Path("tee.stl").write_bytes(stl(shapes.tee()))
    Path("planes.toml").write_text("version = 1\n")
    assert main(["decompose", "tee.stl", *arguments, *COARSE, "--json", "out.json"]) == 0
    turn = 30.0 if "process.rotate_deg" in arguments[-1] else 0.0
    assert json.loads(Path("out.json").read_text())["rotate_deg"] == [0.0, 0.0, turn]


def test_profiles_show_and_check_agree(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["profiles", "show", "generic_ac", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["machine"]["tilt"]["letter"] == "A"
    Path("mine.toml").write_text('inherits = "generic_ac"\n[machine.tilt]\nlimits_deg = [50.0, -50.0]\n')
    assert main(["profiles", "check", "mine.toml"]) == 1
    assert "limits_deg" in capsys.readouterr().err


def _program(folder: Path) -> Path:
    """Six hours of slow strokes over a hot bed."""
    lines = ["G21", "G90", "M83", "G28 X Y Z", "G92 A0 C0", "M140 S60", "M190 S60", "M104 S210", "M109 S210", "G0 Z0.2 F600"]
    lines += [f"G1 X{40 * (k % 2)} E1.0 F60" for k in range(1, 600)]
    file = folder / "long.gcode"
    file.write_text("\n".join([*lines, "M104 S0", "M140 S0"]) + "\n")
    return file


def test_an_interrupted_print_ends_with_heaters_off_and_exit_130(folder: Path) -> None:
    options = ["--port", "sim", "--sim-speed", "60", "--force"]
    command = [sys.executable, "-m", "machine.cli.cli", "print", str(_program(folder)), *options]
    pipe = subprocess.PIPE
    for process, number in [
        (subprocess.Popen(command, stderr=pipe, stdout=pipe, text=True, cwd=Path(__file__).parents[3]), number)
        for number in (signal.SIGINT, signal.SIGTERM)  # both processes heat up at the same time
    ]:
        _wait_for(process, "printing:")
        os.kill(process.pid, number)
        _, message = process.communicate(timeout=60)
        assert (process.returncode, "heaters off" in message) == (130, True)


INTERRUPTED = """
import os, signal, sys, threading
import {module} as module

def interrupted(*given, **named):
    end = os.kill, (os.getpid(), signal.SIGINT)
    threading.Timer({later_s}, *end).start() if {later_s} else end[0](*end[1])
    return stage(*given, **named)

stage, module.{stage} = module.{stage}, interrupted
from machine.cli.cli import main
sys.exit(main())
"""
PIPELINE = "machine.pipeline.pipeline"


@pytest.mark.parametrize(
    ("module", "stage", "later_s", "written"),
    [
        (PIPELINE, "read_model", 0.0, []),
        (PIPELINE, "slice_parts", 0.2, []),
        (PIPELINE, "dry_run", 0.0, []),
        ("profiles.files", "_umask", 0.0, []),  # after the file's content is written, before it is renamed
        ("machine.cli.commands.export", "write_json", 0.0, ["out.gcode"]),
    ],
)
def test_an_interrupted_export_leaves_no_file_half_written_and_no_process(
    folder: Path, module: str, stage: str, later_s: float, written: list[str]
) -> None:
    script = INTERRUPTED.format(module=module, stage=stage, later_s=later_s)
    words = ["export", "demo:bracket", "--as-is", "--parts", "1", "-o", "out.gcode", "--json", "out.json"]
    words += [] if later_s else [*COARSE, "--set", "process.scale=0.2"]  # otherwise it would end before the interrupt
    given = {"PYTHONPATH": str(Path(__file__).parents[3])}
    with subprocess.Popen(
        [sys.executable, "-c", script, *words], stderr=subprocess.PIPE, text=True, start_new_session=True, env=os.environ | given
    ) as process:
        message = process.communicate(timeout=100)[1]
    assert (process.returncode, message.splitlines()[-1]) == (130, "tiltprint: interrupted")
    assert [file.name for file in folder.iterdir() if file.name.startswith((".tiltprint-", "out."))] == written
    with pytest.raises(ProcessLookupError):
        os.killpg(process.pid, 0)


def _wait_for(process: "subprocess.Popen[str]", word: str) -> None:
    assert process.stderr is not None
    for _ in range(100):
        line = process.stderr.readline()
        if word in line:
            return
        if not line:
            time.sleep(0.1)
    pytest.fail(f"{word!r} was never said")


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("profiles list >&-", (0, "")),
        ("profiles list <&-", (0, "")),
        ("export demo:tree -o - >&-", (1, "tiltprint: output -: standard output is closed\n")),
    ],
)
def test_closed_streams_end_no_command_unless_it_writes_to_them(words: str, expected: tuple[int, str]) -> None:
    start = f"{sys.executable} -c 'from machine.cli.start import main; raise SystemExit(main())'"
    command = ["sh", "-c", f"{start} {words}"]
    done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, cwd=Path(__file__).parents[3])
    assert (done.returncode, done.stderr) == expected


def test_ctrl_c_after_a_command_is_done_changes_nothing() -> None:
    program = (
        "import os, signal, sys; from machine.cli.start import main; sys.argv = ['tiltprint', '--version']; code = main(); "
        "os.kill(os.getpid(), signal.SIGINT); sys.exit(code)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=Path(__file__).parents[3])
    assert (done.returncode, done.stderr) == (0, "")


def test_the_console_of_a_closed_input_ends_at_once() -> None:
    start = f"{sys.executable} -c 'from machine.cli.start import main; raise SystemExit(main())'"
    command = ["sh", "-c", f"{start} console --port sim <&-"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, cwd=Path(__file__).parents[3])
    assert (done.returncode, "a bug in tiltprint" in done.stderr) == (0, False)


def test_a_package_that_another_program_has_overwritten_is_named_at_the_start(tmp_path: Path) -> None:
    (tmp_path / "slicer").mkdir()
    (tmp_path / "slicer" / "__init__.py").write_text("from .slicer import Slicer\n")
    start = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); from machine.cli.start import main; raise SystemExit(main())"
    done = subprocess.run([sys.executable, "-c", start, "--version"], capture_output=True, text=True, check=False)
    sentence = f"tiltprint: {tmp_path / 'slicer'} belongs to another program: install tiltprint into an environment of its own\n"
    assert (done.returncode, done.stderr) == (1, sentence)


def test_a_package_of_another_program_without_a_first_file_and_a_missing_one_are_named_at_the_start(tmp_path: Path) -> None:
    (tmp_path / "mdp").mkdir()
    look = (
        f"import sys; from machine.cli.start import package_trouble; sys.path[:] = [{str(tmp_path)!r}]; print(package_trouble())"
    )
    done = subprocess.run([sys.executable, "-c", look], capture_output=True, text=True, check=True)
    assert done.stdout == "the package profiles is missing\n"
    (tmp_path / "profiles").mkdir()
    (tmp_path / "profiles" / "__init__.py").write_text('"""tiltprint: ours."""')
    done = subprocess.run([sys.executable, "-c", look], capture_output=True, text=True, check=True)
    assert done.stdout == f"{tmp_path / 'mdp'} belongs to another program\n"


def test_a_closed_standard_output_is_no_bug() -> None:
    command = f"{sys.executable} -m machine.cli.cli profiles list >&-"
    ended = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (0, "")


def test_the_entry_point_runs_as_a_module() -> None:
    command = [sys.executable, "-m", "machine.cli.start", "--version"]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout.startswith("tiltprint ")


def test_a_saved_profile_is_overwritten_only_on_request(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    own = tmp_path / "own.toml"
    save = ["profiles", "save", "pla", "-o", str(own), "--set"]
    assert main([*save, "material.nozzle_c=200"]) == 0
    assert main([*save, "material.nozzle_c=205"]) == 1
    assert "own.toml exists: --replace writes over it, another name leaves it" in capsys.readouterr().err
    assert "200" in own.read_text()
    assert main([*save, "material.nozzle_c=205", "--replace"]) == 0
    assert ("205" in own.read_text(), "200" in own.with_suffix(".toml.before").read_text()) == (True, True)


def test_an_export_in_one_part_searches_no_parts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("machine.notices.PLAIN_EVERY_S", 0.0)
    out = str(tmp_path / "out.gcode")
    assert main(["export", "demo:bracket", *FAST, "--parts", "1", "--set", "process.scale=0.3", "-o", out]) == 0
    assert "searching parts" not in capsys.readouterr().err
