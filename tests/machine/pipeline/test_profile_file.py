"""User profiles: a profile that is written reads back equal, whatever was changed."""

from pathlib import Path

import pytest

from machine.cli.cli import main
from machine.pipeline.profile_file import profile_text
from profiles.profile import check_file, known, load_one

BLOCK = 'machine.gcode.start="G28\\nM117 \'ready\' \\"{nozzle_c}\\" \\\\\\n"'  # as typed in a terminal


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("gen5x", ["machine.tilt.limits_deg=[-30, 30]", BLOCK, "machine.head.boxes=[]", 'machine.name="42"']),
        ("generic_ac", ['machine.sources={"machine.x" = "measured"}', "machine.uncalibrated=[]"]),  # inherited rows are removed
        ("generic_ac", ["machine.shape=fixed"]),
        ("three_axis", ["machine.sources={}"]),
        ("three_axis", ["machine.table.radius_mm=90", "machine.table.size_mm="]),  # which has a value in this profile
        ("tpu", ["material.pressure_advance=0.1"]),
        ("fine", ["process.walls=5", "search.beam_width=9", "process.rotate_deg=[0, 90, 0]"]),
    ],
)
def test_a_profile_with_changes_is_saved_and_read_back_the_same(name: str, settings: list[str], tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    assert main(["profiles", "save", name, "-o", str(file), *(word for setting in settings for word in ("--set", setting))]) == 0
    assert load_one(str(file)) == load_one(name, settings)
    assert check_file(file) == []


def test_a_profile_lists_its_differences_from_the_shipped_profile_it_inherits(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    own.write_text('inherits = "pla"\n[material]\nname = "my PLA"\nbed_c = 55\n')
    assert profile_text("material", str(own), ["material.fan=0.8"]) == (
        'inherits = "pla"\n\n[material]\nname = "my PLA"\nbed_c = 55.0\nfan = 0.8\n'
    )


def test_a_value_that_is_stated_stays_when_the_shipped_profile_changes() -> None:
    text = profile_text("machine", "generic_ac", ["machine.name=mine"], ["machine.x.limits_mm", "machine.lift_mm"])
    assert (
        text
        == 'inherits = "generic_ac"\n\n[machine]\nname = "mine"\nlift_mm = 10.0\n\n[machine.x]\nlimits_mm = [-160.0, 160.0]\n'
    )


@pytest.mark.parametrize("kind", ["machine", "material", "process"])
def test_every_shipped_profile_can_be_saved_unchanged(kind: str, tmp_path: Path) -> None:
    for name in known(kind):
        (tmp_path / f"{name}-own.toml").write_text(profile_text(kind, name))
        assert load_one(str(tmp_path / f"{name}-own.toml")) == load_one(name)
