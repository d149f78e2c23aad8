"""The error message of an invalid text is one short line."""

from pathlib import Path

import pytest

from profiles.errors import ProfileError
from profiles.places import tables
from profiles.profile import check_file, load
from profiles.toml_text import read_toml, read_value


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("walls = " + "[" * 100_000, "it is nested too deep"),
        ("walls = " + "9" * 5000, "a number in it has too many digits"),
        ("walls = ", "Invalid value (at end of document)"),
    ],
)
def test_a_text_that_is_no_toml_is_one_reason(text: str, reason: str) -> None:
    with pytest.raises(ValueError, match="^" + reason.replace("(", r"\(").replace(")", r"\)") + "$"):
        read_toml(text)
    assert read_value(text) == text


def test_a_byte_order_mark_is_fine(tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text('inherits = "standard"\n[process]\nwalls = 2\n', encoding="utf-8-sig")
    assert check_file(tmp_path / "own.toml") == []
    assert load(process=str(tmp_path / "own.toml")).process.walls == 2


def test_profiles_may_inherit_through_others_but_not_in_a_cycle(tmp_path: Path) -> None:
    for k in range(40):
        (tmp_path / f"{k}.toml").write_text(f'inherits = "{k + 1}.toml"\n[process]\nwalls = 2\n')
    (tmp_path / "40.toml").write_text('inherits = "standard"\n[process]\nwalls = 2\n')
    assert tables("process", str(tmp_path / "20.toml"))["process"]["walls"] == 2
    with pytest.raises(ProfileError, match="is inherited through 32 profiles: at most 32 are allowed"):
        tables("process", str(tmp_path / "0.toml"))


@pytest.mark.parametrize("value", ["9" * 5000, "[" * 50_000])
def test_a_setting_without_end_is_refused_like_any_other(value: str) -> None:
    with pytest.raises(ProfileError, match=r"process.walls is .*: it must be a whole number from 0 to 50"):
        load(settings=[f"process.walls={value}"])
