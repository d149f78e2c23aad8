"""The sheet of touches: errors in it are reported, and empty rows are left out."""

from pathlib import Path

import pytest

from machine.setup.calibration.program import plan_touches
from machine.setup.calibration.sheet import read_sheet, sheet_text
from profiles.errors import ProfileError
from tests.machine.setup.calibration.touches import machine_of


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[[touch]]\ntilt_deg = 0\nturn_deg = 0\nxyz_mm = [1, 2]\n", r"touch 1: xyz_mm is \[1, 2\]: it must be a list of three"),
        ("[[touch]]\nturn_deg = 0\nxyz_mm = [1, 2, 3]\n", "touch 1: tilt_deg is None: it must be a number"),
        ("[[touch]]\ntilt_deg = 0\nturn_deg = 0\nxyz_mm = [1, 2, 3]\non = 'bed'\n", "on is 'bed': it must be one of mark, plate"),
        ("touches = 3\n", "touches is not a key of a calibration sheet"),
        ("mark_height_mm = 'high'\n", "mark_height_mm is 'high': it must be a number"),
        ("touch = 3\n", "touch must be a list of tables"),
    ],
)
def test_a_wrong_sheet_is_refused(text: str, sentence: str, tmp_path: Path) -> None:
    (tmp_path / "sheet.toml").write_text(text)
    with pytest.raises(ProfileError, match=sentence):
        read_sheet(tmp_path / "sheet.toml")


def test_a_wrong_csv_is_refused(tmp_path: Path) -> None:
    (tmp_path / "sheet.csv").write_text("tilt_deg,turn_deg,x_mm,y_mm\n0,0,1,2\n")
    with pytest.raises(ProfileError, match="the columns z_mm are missing"):
        read_sheet(tmp_path / "sheet.csv")
    (tmp_path / "sheet.csv").write_text("tilt_deg,turn_deg,x_mm,y_mm,z_mm\n0,0,1,2,high\n")
    with pytest.raises(ProfileError, match="touch 1: z_mm is 'high'"):
        read_sheet(tmp_path / "sheet.csv")


def test_a_csv_with_a_byte_order_mark_is_read_as_without(tmp_path: Path) -> None:
    (tmp_path / "sheet.csv").write_text("\ufefftilt_deg,turn_deg,x_mm,y_mm,z_mm,on\n30,0,1,2,3,plate\n", "utf-8")
    assert [touch.at_mm for touch in read_sheet(tmp_path / "sheet.csv").touches] == [(1.0, 2.0, 3.0)]


def test_an_empty_sheet_holds_no_touch(tmp_path: Path) -> None:
    machine = machine_of("generic_ac")
    (tmp_path / "sheet.toml").write_text(sheet_text("generic_ac", machine, plan_touches(machine, 20.0)))
    sheet = read_sheet(tmp_path / "sheet.toml")
    assert (sheet.touches, sheet.mark_height_mm, sheet.machine) == ((), 20.0, "generic_ac")


def test_touches_of_a_mark_of_unknown_height_are_refused_unless_all_are_of_the_plate(tmp_path: Path) -> None:
    sheet, head = tmp_path / "sheet.csv", "tilt_deg,turn_deg,x_mm,y_mm,z_mm,on\n"
    sheet.write_text(f"{head}0,0,1,2,3,mark\n")
    with pytest.raises(ProfileError, match="the height of the mark is missing: --mark-height gives it"):
        read_sheet(sheet)
    assert read_sheet(sheet, 20.0).mark_height_mm == 20.0
    sheet.write_text(f"{head}0,0,1,2,3,plate\n0,90,,,,mark\n")
    assert [touch.on_plate for touch in read_sheet(sheet).touches] == [True]
