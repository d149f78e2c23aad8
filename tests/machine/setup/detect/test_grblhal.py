"""Detection of a machine from grblHAL's answers to $$ and $I."""

import pytest

from machine.setup.detect.found import ConfigText, Found
from machine.setup.detect.grblhal import recognise
from machine.setup.detect.proposal import propose, read
from profiles.errors import ProfileError

DUMP = """[VER:1.1f.20240801:]
[OPT:VNMSL,35,1024,5,0]
[AXS:5:XYZAC]
$11=0.020
$13=1
$21=0
$22=1
$23=3
$27=2.000
$100=80.000
$110=6000.000
$111=5400.000
$112=900.000
$113=1800.000
$114=3600.000
$120=400.000
$121=500.000
$122=60.000
$123=200.000
$124=300.000
$130=200.000
$131=180.000
$132=120.000
$133=90.000
$134=0.000
$376=5
ok
"""


def found(text: str = DUMP) -> Found:
    return read(ConfigText("grbl.txt", text))


def values(found: Found, letter: str) -> dict[str, object]:
    return {key: reading.value for key, reading in found.axes[letter].items()}


def test_rates_are_a_minute_and_an_axis_moves_below_0() -> None:
    assert recognise(DUMP)
    assert values(found(), "X") == {"speed": 100.0, "acceleration": 400.0, "limits": [-200.0, 0.0]}
    assert values(found(), "A") == {"speed": 30.0, "acceleration": 200.0, "limits": [-90.0, 0.0]}


def test_a_travel_of_0_bounds_nothing() -> None:
    assert values(found(), "C") == {"speed": 60.0, "acceleration": 300.0}


def test_an_origin_at_home_counts_from_the_side_of_the_switch() -> None:
    told = found(DUMP.replace("$22=1", "$22=9"))
    assert (values(told, "X")["limits"], values(told, "Z")["limits"]) == ([0.0, 200.0], [-120.0, 0.0])


def test_hard_limits_leave_the_pull_off_at_both_ends() -> None:
    assert values(found(DUMP.replace("$21=0", "$21=1")), "X")["limits"] == [-198.0, -2.0]


def test_letters_buffer_and_corner_are_read() -> None:
    told = found()
    assert (told.firmware, told.rotary, told.settings["receive_bytes"].value) == ("grblHAL 1.1f.20240801", "AC", 1024)
    assert told.settings["junction_speed_mm_s"].value == 4.3947  # sqrt(400 x 0.02 x (1 + sqrt 2))


def test_letters_that_the_dump_does_not_name_are_not_guessed() -> None:
    with pytest.raises(
        ProfileError, match=r"^grbl.txt: it has more than three axes, whose letters only \$I names: add its answer"
    ):
        found(DUMP.replace("[AXS:5:XYZAC]\n", ""))
    three = "".join(line for line in DUMP.splitlines(True) if line[:5] not in ("[AXS:", "$113=", "$114=", "$123=", "$124="))
    assert found(three).rotary == ""


def test_without_376_no_axis_is_known_to_be_rotary() -> None:
    told = found(DUMP.replace("$376=5\n", ""))
    assert (told.rotary, list(told.doubtful)) == ("", ["A", "C"])
    with pytest.raises(ProfileError, match=r"it has no \$376, which says whether A turns.*: --base NAME"):
        propose(told)
    assert propose(told, "generic_ac").values["machine.tilt.letter"].value == "A"


def test_an_axis_that_376_calls_linear_does_not_turn() -> None:
    assert found(DUMP + "$376=1\n").rotary == "A"


def test_half_a_dump_is_refused() -> None:
    with pytest.raises(ProfileError, match="no acceleration of Y, no acceleration of Z: is it whole"):
        found(DUMP.replace("$121=500.000\n$122=60.000\n", ""))
    with pytest.raises(ProfileError, match=r"axis X: \$130 gives limits from 50 to 0"):
        found(DUMP.replace("$130=200", "$130=-50"))
