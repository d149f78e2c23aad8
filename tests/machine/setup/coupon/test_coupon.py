"""The coupon command: program, simulated print, sheet, own profiles and report; or a dialogue for the loads."""

import re
import tomllib
from dataclasses import replace
from math import nan
from pathlib import Path

import pytest

from machine.cli.cli import main
from machine.cli.commands.measuring.coupon import UNSUPPORTED, ask_for_loads
from machine.cli.terminal.options import DefaultProfileOptions
from machine.cli.terminal.requests import CouponRequest
from machine.setup.coupon.bars import SHAPES
from machine.setup.coupon.design import Sheet, read_sheet, sheet_text
from machine.setup.coupon.plate import coupon
from profiles.errors import OutputError
from profiles.places import own_folder
from profiles.profile import load
from slicer.estimate.estimate import estimate
from tests.machine.setup.calibration.person import Person
from tests.machine.setup.coupon.sheets import FACTORS, WHOLE_MPA, broken

NAMES = ("generic_ac", "pla", "standard")
TRUTH = (1.3, 0.75, 1.3, 1.0)
TWO_HOURS_S = 7200.0


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "settings"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def written(sheet: Sheet, name: str = "coupon.toml") -> str:
    Path(name).write_text(sheet_text(sheet), encoding="utf-8")
    return name


def test_the_bars_are_estimated_to_be_printed_within_two_hours() -> None:
    profile = load(*NAMES, settings=UNSUPPORTED)
    assert estimate(coupon(SHAPES["bend"], profile).parts, profile).time_s <= TWO_HOURS_S


def test_a_simulated_print_leads_from_the_program_to_own_profiles(capsys: pytest.CaptureFixture[str]) -> None:
    coarse = ["--set", "process.layer_height_mm=0.4"]
    assert main(["coupon", "-o", "coupon.gcode", "--html", "bars.html", "--png", "bars.png", *coarse]) == 0
    assert "error" not in capsys.readouterr().out
    lines = Path("coupon.gcode").read_text().splitlines()
    parts = [line for line in lines if line.startswith(";PART:")]
    assert [line.split(":")[1] for line in parts] == [f"{part} of 9" for part in range(1, 10)]
    turned = [line for line in lines if line.startswith(";POSE:")]
    assert len(set(turned)) == 9
    assert all("A45.0000" in line for line in turned[1:])
    assert sum(line == "M104 S230" for line in lines) == 4  # half of the joints are printed 20 deg C hotter
    assert Path("bars.png").read_bytes().startswith(b"\x89PNG")
    assert b"<html" in Path("bars.html").read_bytes()

    assert main(["print", "coupon.gcode", "--port", "sim", "--sim-speed", "0"]) == 0
    laid = re.search(r"([\d.]+) cm³ of plastic laid \(planned ([\d.]+)\), heaters off", "".join(capsys.readouterr()))
    assert laid is not None
    assert float(laid[1]) == pytest.approx(float(laid[2]), rel=1e-2)

    empty = read_sheet(Path("coupon.toml"))
    assert (empty.machine, empty.material, empty.process, empty.factors) == (*NAMES, FACTORS)
    assert main(["coupon", "--measured", "coupon.toml"]) == 1
    assert "0 loads are too few" in capsys.readouterr().err
    filled = written(replace(empty, loads_n=broken(TRUTH, 3, 0.1, 5).loads_n))
    assert main(["coupon", "--measured", filled]) == 0
    assert "interface_temperature_add_c = 20.0 instead of 10.0" in capsys.readouterr().out
    process = load(*NAMES).process
    assert (process.interface_overlap, process.interface_temperature_add_c, process.interface_flow) == (0.75, 20.0, 1.1)


def test_strengths_and_winners_are_saved_with_date_and_source(capsys: pytest.CaptureFixture[str]) -> None:
    sheet = written(broken(TRUTH, 3, 0.001))
    assert main(["coupon", "--measured", sheet, "--save", "mine"]) == 0
    assert "use it as --material mine" in capsys.readouterr().out
    profile = load("generic_ac", "mine", "mine")
    assert profile.material.interlayer_strength_mpa == pytest.approx(WHOLE_MPA["z"], rel=0.01)
    assert profile.material.cold_weld_mpa == pytest.approx(12.0 * 1.3 * 1.3, rel=0.01)
    assert profile.material.nozzle_c == load().material.nozzle_c
    for kind, count in (("material", 2), ("process", 2)):
        text = (own_folder(kind) / "mine.toml").read_text()
        assert len(re.findall(r"# tiltprint coupon, \d{4}-\d\d-\d\d, 36 loads, scatter 0 %", text)) == count
        assert tomllib.loads(text)["inherits"] in NAMES
    assert main(["coupon", "--measured", sheet, "--save", "mine"]) == 1
    assert "--replace writes over it" in capsys.readouterr().err
    assert main(["coupon", "--measured", sheet, "--save", "mine", "--replace"]) == 0
    assert (own_folder("material") / "mine.toml.before").exists()


def test_without_a_winner_the_process_stays_and_joints_have_a_share_of_the_strength(
    capsys: pytest.CaptureFixture[str],
) -> None:
    sheet = broken((1.0,) * 4, 1, 0.01, 2)
    jointed = replace(sheet, loads_n=(*sheet.loads_n[:8], *((nan,),) * 4))
    assert main(["coupon", "--measured", written(jointed)]) == 0
    assert "no setting is better than the process's own: it stays as it is" in capsys.readouterr().out
    assert not own_folder("process").exists()
    material = load().material
    assert material.interlayer_strength_mpa == 20.0
    assert material.cold_weld_factor == pytest.approx(12.0 / 20.0, rel=0.03)


def test_a_joint_stronger_than_one_piece_counts_as_one_piece() -> None:
    assert main(["coupon", "--measured", written(broken((3.0, 1.0, 1.0, 1.0), 1, 0.001))]) == 0
    assert load().material.cold_weld_factor == 1.0


def test_the_report_is_a_table_and_saves_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    sheet = written(broken(TRUTH, 3, 0.1, 5))
    assert main(["coupon", "--measured", sheet, "--report", "joints.md"]) == 0
    assert not own_folder("material").exists()
    lines = Path("joints.md").read_text().splitlines()
    assert lines[0] == "# Joints: pla on generic_ac"
    assert "| loads | 36 |" in lines
    widths = [line.count("|") for line in lines if line.startswith("|")]
    assert sorted(set(widths)) == [3, 4, 5]
    bars = [line for line in lines if re.match(r"\| \d+ \|", line)]
    assert len(bars) == 12
    assert main(["coupon", "--measured", sheet, "--report", "-"]) == 0
    assert capsys.readouterr().out == Path("joints.md").read_text()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (
            ["--measured", "coupon.toml", "--machine", "gen5x"],
            "a sheet of generic_ac: --machine generic_ac is expected, not gen5x",
        ),
        (["--measured", "coupon.toml", "--material", "petg"], "a sheet of pla: --material pla is expected, not petg"),
        (["--measured", "nowhere.toml"], "sheet nowhere.toml cannot be read"),
        (["-o", "coupon.gcode"], "coupon.toml exists: --replace writes over it"),
        (
            ["-o", "x.toml"],
            "-o x.toml: the sheet is written there, beside the program: another ending is expected, such as .gcode",
        ),
        (["-o", "x.gcode", "--shape", "round"], "--shape round: bend or tensile is expected"),
        (["-o", "x.gcode", "--machine", "three_axis"], "three axes has three axes"),
        (["-o", "x.gcode", "--vary", "interface_flow=7"], "process.interface_flow is 7: it must be a number from 0.5 to 1.5"),
        (["-o", "x.gcode", "--measured", "coupon.toml"], "one of -o OUT.gcode and --measured FILE is expected"),
        (["--report", "x.md"], "--report x.md goes with --measured FILE"),
        (["--png", "x.png"], "--png x.png goes with -o OUT.gcode"),
        ([], "one of -o OUT.gcode and --measured FILE is expected"),
    ],
)
def test_a_wrong_argument_is_refused_in_one_sentence_and_nothing_is_written(
    arguments: list[str], said: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    written(broken(TRUTH, 1))
    assert main(["coupon", *arguments]) == 1
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert [file.name for file in folder.iterdir() if file.name != "state"] == ["coupon.toml"]


def asked(monkeypatch: pytest.MonkeyPatch, *lines: str) -> Person:
    person = Person(*lines)
    monkeypatch.setattr("builtins.input", person)
    ask_for_loads(CouponRequest(given=DefaultProfileOptions()))
    return person


def test_the_user_is_led_through_the_bars_to_own_profiles(monkeypatch: pytest.MonkeyPatch) -> None:
    loads = broken(TRUTH, 3, 0.05, 1).loads_n
    lines = [" ".join(f"{load:.1f}" for load in of_bar) for of_bar in loads]
    first_in_kg = " ".join(f"{load / 9.80665:.2f}kg" for load in loads[0])
    person = asked(monkeypatch, "1", "b", first_in_kg, *lines[1:11], "s")
    assert person.asked[0] == person.asked[2].replace(" [1]", "")
    assert "bar 1, jointed, interface_temperature_add_c = 20.0, interface_bottom_layers = 2, N" in person.asked[0]
    assert load(*NAMES).process.interface_temperature_add_c == 20.0


@pytest.mark.parametrize(
    ("reply", "said"),
    [
        ("much", "'much' cannot be read: a number such as 85 or 9.2kg is expected"),
        ("0", "a load of 0 N cannot be"),
        ("nan", "'nan' cannot be read"),
        ("inf", "a load of inf N cannot be"),
        ("85 -3", "a load of -3 N cannot be"),
        ("5000kg", "a load of 49033.2 N cannot be"),
        ("", "'' cannot be read"),
    ],
)
def test_a_load_is_judged_as_soon_as_it_is_typed_and_ctrl_c_leaves_nothing(
    reply: str, said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(KeyboardInterrupt):
        asked(monkeypatch, reply)
    assert said in capsys.readouterr().out
    assert not own_folder("material").exists()


def test_too_few_loads_are_reported_and_requested_again(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    loads = broken(TRUTH, 1, 0.05, 1).loads_n
    lines = [f"{of_bar[0]:.1f}" for of_bar in loads]
    asked(monkeypatch, *lines[:4], *["s"] * 8, *lines)
    assert "4 loads are too few" in capsys.readouterr().out
    assert load().material.cold_weld_factor < 1.0


def test_existing_files_are_reported_before_any_question(monkeypatch: pytest.MonkeyPatch) -> None:
    assert main(["coupon", "--measured", written(broken(TRUTH, 3, 0.01))]) == 0
    monkeypatch.setattr("builtins.input", Person())
    with pytest.raises(OutputError, match="--replace writes over it"):
        ask_for_loads(CouponRequest(given=DefaultProfileOptions()))
