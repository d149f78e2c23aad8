"""A calibrated profile in the user's own folder: existing settings of the user are kept."""

import tomllib
from pathlib import Path

import pytest

from machine.setup.files import own_profile
from profiles.places import own_folder

TABLES = {
    "machine": {"uncalibrated": [], "tilt": {"sign": 1, "point_mm": [0.0, 1.5, -3.25]}, "sources": {"machine.tilt.sign": "me"}}
}


@pytest.fixture
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    own_folder("machine").mkdir(parents=True)
    return own_folder("machine") / "mine.toml"


def test_a_new_profile_inherits_the_machine_and_holds_the_numbers(mine: Path) -> None:
    assert own_profile("machine", "mine", "generic_ac", TABLES)[0] == mine
    assert tomllib.loads(own_profile("machine", "mine", "generic_ac", TABLES)[1]) == {"inherits": "generic_ac", **TABLES}


def test_comments_and_other_keys_of_a_profile_stay(mine: Path) -> None:
    mine.write_text('# my printer\ninherits = "generic_ac"\n[machine.tilt]\nsign = -1  # wrong way round?\nzero_deg = 2.0\n')
    text = own_profile("machine", "mine", "generic_ac", TABLES)[1]
    assert text.startswith("# my printer\n")
    assert "sign = 1  # wrong way round?\nzero_deg = 2.0\n" in text
    assert tomllib.loads(text)["machine"]["sources"] == {"machine.tilt.sign": "me"}


def test_dotted_keys_are_saved_right(mine: Path) -> None:
    mine.write_text('machine.tilt.sign = -1\nmachine.name = "x"\n')
    machine = tomllib.loads(own_profile("machine", "mine", "generic_ac", TABLES)[1])["machine"]
    assert (machine["name"], machine["tilt"]["sign"], machine["uncalibrated"]) == ("x", 1, [])
