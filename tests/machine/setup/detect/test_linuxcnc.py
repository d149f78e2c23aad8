"""Detection of a machine from LinuxCNC's .ini file."""

import pytest

from machine.setup.detect.found import ConfigText, Found
from machine.setup.detect.linuxcnc import recognise
from machine.setup.detect.proposal import propose, read
from profiles.errors import ProfileError

INI = """
[EMC]
MACHINE = Cradle mill
[TRAJ]
COORDINATES = X Y Z A C
LINEAR_UNITS = mm
ANGULAR_UNITS = degree
MAX_LINEAR_VELOCITY = 60
[KINS]
KINEMATICS = xyzac-trt-kins sparm=identityfirst
JOINTS = 5
#INCLUDE axes.inc
"""
AXES = """
[AXIS_X]
MIN_LIMIT = -900
MAX_LIMIT = 900
MAX_VELOCITY = 75
MAX_ACCELERATION = 500
[AXIS_Y]
MAX_VELOCITY = 40
MAX_ACCELERATION = 450
[AXIS_Z]
MAX_VELOCITY = 20   # slow
MAX_ACCELERATION = 200
[JOINT_0]
MIN_LIMIT = -150
MAX_LIMIT = 152.5
[JOINT_3]
MIN_LIMIT = -95
MAX_LIMIT = 20
MAX_VELOCITY = 25
MAX_ACCELERATION = 120
[JOINT_4]
MIN_LIMIT = -1e99
MAX_LIMIT = 1e99
MAX_VELOCITY = 30
MAX_ACCELERATION = 150
"""


def found(text: str = INI, axes: str = AXES) -> Found:
    return read(ConfigText("mill.ini", text, lambda name: [ConfigText(name, axes)]))


def values(found: Found, letter: str) -> dict[str, object]:
    return {key: reading.value for key, reading in found.axes[letter].items()}


def test_the_joints_give_the_reach_when_the_kinematics_follow_the_table() -> None:
    assert recognise(INI)
    assert values(found(), "X") == {"speed": 60.0, "acceleration": 500.0, "limits": [-150.0, 152.5]}
    assert values(found(INI.replace("xyzac-trt-kins", "trivkins")), "X")["limits"] == [-900.0, 900.0]


def test_rotary_axes_follow_from_their_joints_and_1e99_means_no_limit() -> None:
    told = found()
    assert (told.rotary, told.name) == ("AC", "Cradle mill")
    assert values(told, "A") == {"speed": 25.0, "acceleration": 120.0, "limits": [-95.0, 20.0]}
    assert values(told, "C") == {"speed": 30.0, "acceleration": 150.0}


def test_kinematics_that_follow_the_table_take_places_on_it() -> None:
    assert found().settings["coordinates"].value == "workpiece"
    assert found(INI.replace("xyzac-trt-kins", "trivkins")).settings["coordinates"].value == "table"


def test_kinematics_without_identityfirst_are_refused() -> None:
    with pytest.raises(ProfileError, match=r"^mill.ini: \[KINS\] KINEMATICS is 'xyzac-trt-kins' without sparm=identityfirst"):
        found(INI.replace(" sparm=identityfirst", ""))


@pytest.mark.parametrize(("module", "named"), [("5axiskins", "5axiskins"), ("xyzab_tdr_kins", "xyzab_tdr_kins"), ("", "")])
def test_kinematics_that_are_not_known_say_of_no_axis_that_it_turns_the_table(module: str, named: str) -> None:
    told = found(INI.replace("xyzac-trt-kins sparm=identityfirst", module))
    with pytest.raises(ProfileError, match=rf"^mill.ini: \[KINS\] KINEMATICS is '{named}', with which A need not turn the table"):
        propose(told)
    assert "coordinates" not in told.settings


def test_a_joint_that_is_linear_is_no_axis_that_turns() -> None:
    with pytest.raises(ProfileError, match=r"^mill.ini: the joint of axis A has TYPE = LINEAR"):
        propose(found(INI, AXES.replace("[JOINT_3]", "[JOINT_3]\nTYPE = LINEAR")))


def test_three_rotary_axes_leave_the_two_of_the_table_unknown() -> None:
    nine = INI.replace("X Y Z A C", "X Y Z A B C").replace("xyzac-trt-kins", "trivkins")
    with pytest.raises(ProfileError, match="LinuxCNC has the rotary axes A B C, and nothing says which tilts"):
        propose(found(nine))


def test_inches_and_radians_become_mm_and_degrees() -> None:
    told = found(INI.replace("= mm", "= inch").replace("= degree", "= radian").replace("VELOCITY = 60", "VELOCITY = 99"))
    assert values(told, "Y") == {"speed": 1016.0, "acceleration": 11430.0}
    assert values(told, "A")["speed"] == 1432.3945


def test_a_file_of_before_2_8_numbers_its_axes() -> None:
    old = "[EMC]\n[TRAJ]\nCOORDINATES = X Y Z\n" + "".join(
        f"[AXIS_{number}]\nMIN_LIMIT = 0\nMAX_LIMIT = {number + 1}00\nMAX_VELOCITY = 9\nMAX_ACCELERATION = 90\n"
        for number in range(3)
    )
    assert values(found(old), "Z") == {"speed": 9.0, "acceleration": 90.0, "limits": [0.0, 300.0]}


@pytest.mark.parametrize(
    ("text", "axes", "sentence"),
    [
        (INI, AXES[:110], "no acceleration of Y, no speed of Z: is it whole"),
        (INI, AXES.replace("152.5", "-152.5"), "axis X: .JOINT_0. MIN_LIMIT, MAX_LIMIT gives limits from -150 to -152.5"),
        (INI.replace("= mm", "= furlong"), AXES, "LINEAR_UNITS is 'furlong': mm or inch is expected"),
        (INI, AXES + "MAX_VEL", "neither a section nor a setting"),
    ],
)
def test_a_truncated_or_absurd_file_is_refused_in_one_sentence(text: str, axes: str, sentence: str) -> None:
    with pytest.raises(ProfileError, match=sentence):
        found(text, axes)


def test_a_line_that_a_backslash_carries_on_is_one() -> None:
    whole = found(INI + "[APPLICATIONS]\nAPP = sim_pin \\\n  joint.0.jog-counts \\\n  joint.1.jog-counts\n")
    assert values(whole, "X") == values(found(), "X")


def test_a_file_of_includes_alone_is_recognised() -> None:
    assert recognise("[EXAMPLE]\nparm = 1\n#INCLUDE traj.inc\n#INCLUDE kins.inc\n")
