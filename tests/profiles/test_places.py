"""The user's profile folder: found, listed, inherited from, and preferred to shipped profiles of equal name."""

import os
from pathlib import Path

import pytest

from machine.cli.cli import main
from profiles.errors import ProfileError
from profiles.messages import terminal_words
from profiles.places import known, own, own_folder, shipped, shipped_base
from profiles.profile import check_file, load, load_one


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder for settings."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    return tmp_path


def keep(kind: str, name: str, text: str) -> Path:
    own_folder(kind).mkdir(parents=True, exist_ok=True)
    (own_folder(kind) / f"{name}.toml").write_text(text, encoding="utf-8")
    return own_folder(kind) / f"{name}.toml"


def test_profiles_are_in_the_settings_folder_of_the_operating_system(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert own_folder("machine") == folder / "tiltprint" / "profiles" / "machines"
    monkeypatch.delenv("XDG_CONFIG_HOME")
    monkeypatch.setattr("sys.platform", "linux")
    assert own_folder("material") == Path(os.path.expanduser("~")) / ".config" / "tiltprint" / "profiles" / "materials"


def test_without_user_profiles_only_the_shipped_ones_are_known() -> None:
    assert [own(kind) for kind in ("machine", "material", "process")] == [[], [], []]
    assert known("machine") == shipped("machine")


def test_an_own_profile_is_found_by_its_name_and_listed_as_yours(capsys: pytest.CaptureFixture[str]) -> None:
    keep("machine", "mine", 'inherits = "generic_ac"\n[machine.tilt]\npoint_mm = [0, 1, -18]\n')
    assert load("mine").machine.tilt.point_mm == (0.0, 1.0, -18.0)
    assert main(["profiles", "list"]) == 0
    assert f"machine, yours ({own_folder('machine')}): mine\n" in capsys.readouterr().out


def test_an_own_profile_replaces_the_shipped_one_it_inherits() -> None:
    keep("machine", "gen5x", 'inherits = "gen5x"\n[machine.tilt]\nzero_deg = 1.5\n')
    machine = load("gen5x").machine
    assert (machine.tilt.zero_deg, machine.x.limits_mm) == (1.5, (-126.0, 125.0))
    assert known("machine").count("gen5x") == 1


def test_user_materials_inherit_from_shipped_and_user_materials() -> None:
    keep("material", "shop", 'inherits = "petg"\n[material]\nflow = 0.97\n')
    keep("material", "shop_red", 'inherits = "shop"\n[material]\nnozzle_c = 231\n')
    material = load(material="shop_red").material
    assert (material.flow, material.nozzle_c, material.name) == (0.97, 231.0, load(material="petg").material.name)


def test_the_shipped_base_of_a_profile_is_found_through_own_ones() -> None:
    keep("material", "shop", 'inherits = "petg"\n[material]\nflow = 0.97\n')
    keep("material", "shop_red", 'inherits = "shop"\n[material]\nnozzle_c = 231\n')
    keep("material", "alone", "[material]\nnozzle_c = 231\n")
    keep("material", "abs", 'inherits = "abs"\n[material]\nflow = 0.95\n')
    keep("material", "shop_abs", 'inherits = "abs"\n[material]\nnozzle_c = 250\n')
    names = ("petg", "shop", "shop_red", "alone", "abs", "shop_abs")
    assert [shipped_base("material", name) for name in names] == ["petg", "petg", "petg", None, None, None]


def test_user_profiles_that_inherit_each_other_are_refused() -> None:
    keep("machine", "a", 'inherits = "b"\n[machine]\nlift_mm = 1\n')
    keep("machine", "b", 'inherits = "a"\n[machine]\nlift_mm = 1\n')
    with pytest.raises(ProfileError, match="a inherits itself through"):
        load_one("a")


def test_an_unknown_name_is_refused_with_a_list_that_includes_own_profiles() -> None:
    keep("machine", "mine", 'inherits = "generic_ac"\n[machine]\nlift_mm = 1\n')
    with pytest.raises(ProfileError, match=r"gen5x, generic_ac, linuxcnc_xyzac, mine, open5x"):
        load("yours")


def test_all_problems_of_a_machine_are_reported_at_once(tmp_path: Path) -> None:
    file = keep(
        "machine",
        "bad",
        """
inherits = "generic_ac"
[machine]
lift = 3
uncalibrated = ["machine.tilt.sign", "machine.nix"]
[machine.x]
limits_mm = [10, -10]
speed_mm_s = 0
[machine.y]
limits_mm = [10, -10]
[machine.tilt]
limits_deg = [-0.1, 0.1]
[machine.turn]
letter = "A"
[machine.head]
silhouette_mm = [[1, 0], [0.5, 2], [3, 1]]
[matrial]
""",
    )
    problems = [*map(terminal_words, check_file(file))]
    assert [problem.split(":")[0] for problem in problems[1:]] == [
        "machine.x.speed_mm_s is 0",
        "machine.lift is not a key of a profile",
        "machine.x.limits_mm is [10.0, -10.0]",
        "machine.y.limits_mm is [10.0, -10.0]",
        "machine.head.silhouette_mm",
        "machine.head.silhouette_mm",
        "machine.tilt.letter and turn.letter are both A",
        "machine.tilt.limits_deg is [-0.1, 0.1]",
        "machine.uncalibrated names machine.nix, which is not a key of a machine",
    ]
    assert "[matrial] cannot stand in a machine profile" in problems[0]


def test_a_missing_parent_does_not_hide_the_other_problems() -> None:
    problems = check_file(keep("process", "bad", 'inherits = "nix"\n[process]\nwalls = -1\n'))
    assert "'nix' is not known" in problems[0]
    assert [*map(terminal_words, problems[1:])] == ["process.walls is -1: it must be a whole number from 0 to 50"]


def test_checking_a_machine_reports_every_block_that_cannot_be_filled_in(capsys: pytest.CaptureFixture[str]) -> None:
    file = keep("machine", "bad", 'inherits = "generic_ac"\n[machine.gcode]\nstart = "M104 S{heat}"\nend = "G1 {tlit}0"\n')
    assert main(["profiles", "check", str(file)]) == 1
    errors = capsys.readouterr().err
    assert "machine.gcode.start: placeholder {heat} is not known" in errors
    assert "machine.gcode.end: placeholder {tlit} is not known" in errors


def test_a_shown_machine_states_the_source_of_each_number(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["profiles", "show", "open5x_voron0"]) == 0
    lines = {line.partition(" = ")[0]: line for line in capsys.readouterr().out.splitlines()}
    assert lines["machine.x.limits_mm"].endswith("config.g, M208 M203 M201")
    assert lines["machine.tilt.sign"].endswith("; UNCALIBRATED")


def test_a_misspelt_inherits_is_named_and_nothing_is_called_missing_for_it(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text('inherit = "fractal5pro"\n[machine]\nname = "mine"\n')
    assert check_file(file) == [
        f"{file}: 'inherit' cannot stand in a machine profile (did you mean inherits?): its tables are [machine]"
    ]
