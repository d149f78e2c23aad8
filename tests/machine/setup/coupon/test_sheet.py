"""The sheet of a coupon: written, read back, and checked for wrong entries."""

from math import isnan
from pathlib import Path

import pytest

from machine.setup.coupon.bars import BEND, TENSILE
from machine.setup.coupon.design import empty_sheet, read_sheet, settings_in_words, sheet_text
from profiles.errors import ProfileError
from tests.machine.setup.coupon.sheets import FACTORS, broken

NAMES = ("my printer's", 'C:\\pla "red".toml', "standard")


def test_a_sheet_is_read_as_it_was_written(tmp_path: Path) -> None:
    file = tmp_path / "coupon.toml"
    sheet = broken((1.2, 0.9, 1.0, 1.1), 2, 0.1)
    file.write_text(sheet_text(sheet))
    assert read_sheet(file) == sheet
    file.write_text(sheet_text(empty_sheet(TENSILE, NAMES, FACTORS)))
    read = read_sheet(file)
    assert (read.machine, read.material, read.process, read.shape, read.factors) == (*NAMES, TENSILE, FACTORS)
    assert all(len(loads) == 1 and isnan(loads[0]) for loads in read.loads_n)


def test_it_says_of_each_bar_what_it_is() -> None:
    sheet = empty_sheet(BEND, NAMES, FACTORS[:1])
    words = [settings_in_words(sheet, bar) for bar in range(1, 13)]
    assert words.count("jointed, as the process has it") == words.count("jointed, interface_overlap = 0.75") == 4
    assert words[8:] == ["in one piece, upright"] * 2 + ["in one piece, lying"] * 2
    assert all(f"# {text}\n[[bar]]\nnumber = {bar}\n" in sheet_text(sheet) for bar, text in enumerate(words, start=1))


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("number = 3", "number = 13", "there is no bar 13: the bars are 1 to 12"),
        ("number = 3", "number = 0", "there is no bar 0: the bars are 1 to 12"),
        ("number = 3", 'number = "3"', "there is no bar '3'"),
        ("number = 3", "number = 2", "bar 2 appears twice"),
        ("number = 3", "number = 3\nmass = 2", "bar 3: mass is not known: allowed are number and loads_n"),
        ("[nan]", "[0.0]", "bar 1: a load of 0 N cannot be: above 0 and up to 2133 N (300 MPa) is allowed"),
        ("[nan]", "[-5]", "bar 1: a load of -5 N cannot be"),
        ("[nan]", "[inf]", "bar 1: a load of inf N cannot be"),
        ("[nan]", "[90000]", "bar 1: a load of 90000 N cannot be"),
        ("[nan]", "85", "bar 1: loads_n is 85: it must be a list of numbers"),
        ("[nan]", "[true]", "bar 1: loads_n is [True]: it must be a list of numbers"),
        ("[nan]", '["9kg"]', "bar 1: loads_n is ['9kg']: it must be a list of numbers"),
        ("coupon = 'bend'", "coupon = 'round'", "coupon is 'round': it must be one of bend, tensile"),
        ("machine =", "printer =", "printer is not a key of a coupon's sheet"),
        ("material = 'pla'", "material = 3", "material is 3: the name of a profile is expected"),
        ("own = 0.5", "was = 0.5", "a [[factor]] has key, was, other: key, own and other are expected"),
        ('key = "interface_flow"', 'key = "interface_overlap"', "4 [[factor]] tables: 1 to 5 of different keys are expected"),
        ("[[bar]]\nnumber = 1\nloads_n = [nan]", "", "bar must be a list of tables"),
    ],
)
def test_invalid_values_in_a_sheet_are_refused(tmp_path: Path, before: str, after: str, said: str) -> None:
    text = sheet_text(empty_sheet(BEND, ("generic_ac", "pla", "standard"), FACTORS))
    if not after:
        text, before, after = text.partition("[[bar]]")[0], "coupon =", "bar = 3\ncoupon ="
    file = tmp_path / "coupon.toml"
    file.write_text(text.replace(before, after, 1))
    with pytest.raises(ProfileError) as refusal:
        read_sheet(file)
    assert str(refusal.value).startswith(f"{file}: ")
    assert said in str(refusal.value)
