"""`demo:calibration` for a user: exported, read back, its readings typed on the page or in a command, its numbers saved."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from machine.cli.cli import main
from machine.cli.commands.measuring.calibrate_piece import ask_for_readings
from machine.cli.terminal.requests import CalibrationRequest
from machine.gcode.reader.parse import parse_gcode
from machine.gcode.reader.parsed import MoveKind, ParsedProgram
from machine.kinematics.table import workpiece_path
from machine.setup.calibration.piece import Piece, correct, parse_readings, piece_page, read_piece, readings_text
from profiles.errors import OutputError, ProfileError
from profiles.places import own_folder
from profiles.profile import load
from tests.machine.browser import CHROMIUM, Browser
from tests.machine.setup.calibration.person import Person
from tests.machine.setup.calibration.touches import really

GENERIC = load().machine
COARSE = ["--set", "process.layer_height_mm=0.4", "--set", "search.directions=20"]
READINGS = "2,-1,1.25 0,0.5,- 1,0,1.2 -1,0,1.15"


@pytest.fixture(scope="module")
def gcode(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("piece") / "piece.gcode"
    light = ["--set", "process.walls=1", "--set", "process.infill_density=0.05", "--set", "search.directions=20"]
    assert main(["export", "demo:calibration", "--process", "draft", *light, "-o", str(out)]) == 0
    return out


@pytest.fixture(scope="module")
def program(gcode: Path) -> ParsedProgram:
    return parse_gcode(gcode.read_text().splitlines(), GENERIC)


@pytest.fixture
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    return own_folder("machine") / "mine.toml"


def test_pads_are_on_four_sides_after_quarter_turns_and_a_tilt_of_60(program: ParsedProgram) -> None:
    piece = read_piece(program, GENERIC, "piece.gcode")
    assert [pad.number for pad in piece.pads] == [1, 2, 3, 4]
    assert {abs(round(pad.pose.tilt_deg)) for pad in piece.pads} == {60}
    assert sorted(round(pad.pose.turn_deg) % 360 for pad in piece.pads) == [0, 90, 180, 270]
    assert [pad.ways[2].round(3).tolist() for pad in piece.pads[:2]] == [[0.866, 0.0, 0.5], [0.0, 0.866, 0.5]]
    assert piece.pads[0].ways[0].round(3).tolist() == [0.0, 1.0, 0.0]  # from +X, right is +Y


@pytest.mark.parametrize("setting", ["search.seam_mm=0", "search.method=published", "search.most_parts=2"])
def test_the_piece_is_cut_by_its_plan_whatever_the_search_settings_are(setting: str, tmp_path: Path) -> None:
    out = tmp_path / "parts.json"
    assert main(["decompose", "demo:calibration", "--set", setting, "--json", str(out)]) == 0
    leans = [round(float(np.degrees(np.arccos(part["direction"][2])))) for part in json.loads(out.read_text())["parts"]]
    assert leans == [0, 60, 60, 60, 60]


def test_a_simulated_misaligned_machine_prints_pads_with_the_predicted_offsets(program: ParsedProgram) -> None:
    true = really(GENERIC, {"zero_deg": 0.3, "point_mm": (0.0, 0.2, -12.3)}, {"point_mm": (0.25, -0.1, 0.0)})
    piece = read_piece(program, GENERIC, "piece.gcode")
    shifts = [_mean_shift_mm(program, true, part, pad.middle_mm) for part, pad in enumerate(piece.pads, start=2)]
    roofs = [_mean_shift_mm(program, true, 1, pad.middle_mm) for pad in piece.pads]
    told = np.array([pad.ways @ (shift - roof) for pad, shift, roof in zip(piece.pads, shifts, roofs, strict=True)])
    assert piece.laid_aside_mm(true) == pytest.approx(told, abs=0.02)


def _mean_shift_mm(program: ParsedProgram, true: object, part: int, near_mm: np.ndarray) -> np.ndarray:
    """Mean displacement of the plastic of a part near a point from its intended position."""
    axes = program.end[(program.kind == MoveKind.EXTRUDE) & (program.part == part)]
    meant = workpiece_path(GENERIC, axes)
    near = np.linalg.norm(meant - near_mm, axis=1) < 12.0
    return (workpiece_path(true, axes[near]) - meant[near]).mean(axis=0)  # type: ignore[arg-type]


def test_another_print_is_no_piece() -> None:
    lines = [";PART:1 of 1", ";LAYER_CHANGE", "G90", "M83", "G1 X1 Y1 Z0.2 F1200", "G1 X9 E1"]
    with pytest.raises(ProfileError, match=r"bar.gcode prints 1 parts: a program of demo:calibration has 5"):
        read_piece(parse_gcode(lines, GENERIC), GENERIC, "bar.gcode")


def test_readings_are_text_and_back() -> None:
    assert readings_text(parse_readings(READINGS)) == READINGS


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("0,0,1.2", "has 1 pads: 4 are expected"),
        ("0,x,1.2 0,0 0,0 0,0", "pad 1: '0,x,1.2' cannot be read"),
        ("0,0,1.2 0,0 0,0,12 0,0", "pad 3: height 12 cannot be: 0 to 4 is allowed"),
        ("0,0,1.2 0,-99 0,0 0,0", "pad 2: up -99 cannot be: -30 to 30 is allowed"),
    ],
)
def test_impossible_readings_are_refused(text: str, sentence: str) -> None:
    with pytest.raises(ProfileError, match=sentence):
        parse_readings(text)


def test_the_command_saves_what_the_readings_say(gcode: Path, mine: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", "--printed", str(gcode), "--readings", READINGS, "--save", "mine"]) == 0
    piece = read_piece(parse_gcode(gcode.read_text().splitlines(), GENERIC), GENERIC, "piece.gcode")
    found = correct(GENERIC, [piece], parse_readings(READINGS)[None]).machine
    machine = tomllib.loads(mine.read_text())["machine"]
    assert machine["turn"]["point_mm"] == pytest.approx(found.turn.point_mm, abs=1e-4)
    assert machine["tilt"]["zero_deg"] == pytest.approx(found.tilt.zero_deg, abs=1e-4)
    assert "machine.turn.point_mm" not in machine["uncalibrated"]
    assert "saved: " in capsys.readouterr().out


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        (["--machine", "fractal5pro", "--readings", READINGS], "was made for generic A/C table: --machine names Fractal 5 Pro"),
        (
            ["--readings", "10,0,1.2 0,0,1.2 0,0,1.2 0,0,1.2"],
            "does not fit the others: check it",
        ),
        (["--readings", READINGS, "--readings", READINGS], "--printed is given 1 times, --readings 2 times"),
        (["--readings", READINGS, "-o", "x.gcode"], "--printed excludes -o"),
        ([], "--printed goes with one of --readings TEXT and --html FILE"),
        (["--readings", READINGS, "--html", "page.html"], "--printed goes with one of --readings TEXT and --html FILE"),
        (["--readings", READINGS, "--directions"], "--printed excludes -o"),
    ],
)
def test_readings_that_cannot_be_evaluated_are_refused_and_nothing_is_saved(
    gcode: Path, mine: Path, capsys: pytest.CaptureFixture[str], more: list[str], sentence: str
) -> None:
    assert main(["calibrate", "--printed", str(gcode), *more]) == 1
    assert sentence in capsys.readouterr().err.replace("\n", " ")
    assert not mine.parent.exists() or not list(mine.parent.iterdir())


def test_good_readings_leave_the_profile_as_it_is(gcode: Path, mine: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", "--printed", str(gcode), "--readings", "0,0,1.2 0,0,1.2 0,0,1.2 0,0,1.2"]) == 0
    assert "the profile stays as it is" in capsys.readouterr().out
    assert not mine.parent.exists()


def test_a_terminal_asks_for_the_pads_one_by_one(
    gcode: Path, mine: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    person = Person("2 -1 1.2", "0.5", "b", "2,-1,1.25", "0,0.5,-", "1,0,1.2", "-1,0,1.15")
    monkeypatch.setattr("builtins.input", person)
    assert ask_for_readings(CalibrationRequest(save="mine"), gcode) == 0
    assert person.asked[-1] == "pad 4 (4 holes): right, up, height: "
    out = capsys.readouterr().out
    assert "pad 2: '0.5' cannot be read: two marks and a height are expected" in out
    assert main(["calibrate", "--printed", str(gcode), "--readings", READINGS, "--save", "other"]) == 0
    assert _without_sources(mine) == _without_sources(mine.with_name("other.toml"))


def _without_sources(file: Path) -> dict[str, object]:
    machine = tomllib.loads(file.read_text())["machine"]
    return {"tilt": machine["tilt"], "turn": machine["turn"]}


def test_readings_are_not_requested_if_they_could_not_be_saved(gcode: Path, mine: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mine.parent.mkdir(parents=True)
    mine.write_text('inherits = "generic_ac"\n')
    person = Person()
    monkeypatch.setattr("builtins.input", person)
    with pytest.raises(OutputError, match=r"mine\.toml exists: --replace writes over it"):
        ask_for_readings(CalibrationRequest(save="mine"), gcode)
    assert person.asked == []


def test_a_request_for_one_part_ignores_the_plan_of_the_demo(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["decompose", "demo:calibration", "--parts", "1", "--as-is", *COARSE, "--json", "-"]) == 0
    assert len(json.loads(capsys.readouterr().out)["parts"]) == 1


@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: the page is not tried in a browser")
def test_the_page_shows_the_same_corrections_and_the_command_that_saves_them(program: ParsedProgram, tmp_path: Path) -> None:
    piece = read_piece(program, GENERIC, "piece.gcode")
    page = tmp_path / "page.html"
    page.write_bytes(piece_page(piece, "generic_ac", "piece.gcode"))
    with Browser() as browser:
        browser.open(page.as_uri())
        words = [word for pad in READINGS.split() for word in pad.split(",")]
        browser.value(
            f"""(() => {{ const words = {json.dumps(words)};
            document.querySelectorAll('input').forEach((field, k) => field.value = words[k] === '-' ? '' : words[k]);
            document.querySelector('input').dispatchEvent(new Event('input', {{bubbles: true}})); }})()"""
        )
        shown = browser.value("document.getElementById('found').innerText")
        command = browser.value("document.getElementById('command').textContent")
    assert browser.complaints == []
    for value in _numbers(piece):
        assert value in shown
    assert command == f'tiltprint calibrate --machine generic_ac --printed piece.gcode --readings "{READINGS}" --replace'


def _numbers(piece: Piece) -> list[str]:
    """The corrected axes as the page should show them; one least-squares step and the full fit agree to a micrometre."""
    found = correct(GENERIC, [piece], parse_readings(READINGS)[None])
    turn = " ".join(f"{letter}{value:.3f}" for letter, value in zip("XYZ", found.machine.turn.point_mm, strict=True))
    return [turn, f"{found.sigma[4]:.3f}"]
