"""Touches by keys: the user moves the tip of a machine at a port onto a mark in steps."""

from pathlib import Path

import numpy as np
import pytest

from machine.cli.cli import main
from machine.cli.commands.measuring.calibrate_by_keys import KeyedTouches
from machine.kinematics.table import machine_points
from machine.setup.calibration.fit import Touch
from machine.setup.calibration.program import STEPS_MM, Jog, begin_jog, plan_touches, pressed
from machine.simulator.simulator import SimulatedPrinter
from mdp.pose import Pose, level
from profiles.errors import MoveError
from profiles.places import own_folder
from profiles.profile import load
from tests.machine.setup.calibration.steady_hand import Mover, put_hand_on, steady_hand
from tests.machine.setup.calibration.touches import machine_of, really

GENERIC = machine_of("generic_ac")
MARK = (38.0, 2.0, 20.0)


@pytest.fixture(autouse=True)
def _folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "settings"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


def test_twelve_careful_touches_are_accurate_to_a_hundredth() -> None:
    real, mover = really(GENERIC, {"point_mm": (0.0, 0.8, -13.0)}, {"point_mm": (0.5, -0.4, 0.0)}), Mover()
    plan = plan_touches(GENERIC, MARK[2], float(np.hypot(*MARK[:2])))
    touches = KeyedTouches(GENERIC, plan, mover, steady_hand(mover, real, MARK), lambda line: None).run()  # type: ignore[arg-type]
    exact = [machine_points(real, touch.pose, np.array([MARK]))[0] for touch in touches]
    assert len(touches) == 12
    assert np.abs([touch.at_mm for touch in touches] - np.array(exact)).max() <= 0.5 * STEPS_MM["4"] + 1e-9
    assert min(mover.turned_at_mm) == plan.safe_z_mm  # the table turns under a tip that is above all bodies that turn


def test_a_touch_is_left_out_and_one_is_taken_again() -> None:
    plan, mover = plan_touches(GENERIC, 20.0), Mover()
    keys = iter(["\n", "d", "b", "a", "\n", "n", *["\n"] * 10])
    touches = KeyedTouches(GENERIC, plan, mover, keys, lambda line: None).run()  # type: ignore[arg-type]
    x, y, _ = plan.expected_mm[0]
    assert touches[0] == Touch(plan.poses[0], (x - 1.0, y, mover_height(plan.expected_mm[0][2])))
    assert [touch.pose for touch in touches] == [plan.poses[0], *plan.poses[2:]]


def mover_height(expected_z_mm: float) -> float:
    """The height at which a touch begins: 8 mm above the mark."""
    return expected_z_mm + 8.0


@pytest.mark.parametrize(
    ("at_mm", "key", "sentence"),
    [
        ((0.0, 0.0, 25.5), "f", "Z would be 24.50 mm: 25.00 to"),
        ((-155.0, 0.0, 30.0), "a", "X would be -165.00 mm: -160.00 to 160.00"),
    ],
)
def test_steps_that_are_too_deep_or_too_far_are_refused(at_mm: tuple[float, float, float], key: str, sentence: str) -> None:
    with pytest.raises(MoveError, match=sentence):
        pressed(Jog(at_mm, 25.0, 10.0), key, GENERIC, level(GENERIC))


def test_a_long_step_down_is_a_short_one_where_the_mark_may_be() -> None:
    near, far = Jog((0.0, 0.0, 30.0), 14.0, 10.0), Jog((0.0, 0.0, 60.0), 14.0, 10.0)
    assert pressed(near, "f", GENERIC, level(GENERIC)).at_mm[2] == 29.0
    assert pressed(far, "f", GENERIC, level(GENERIC)).at_mm[2] == 50.0


def test_a_head_that_would_lean_over_the_plate_is_refused() -> None:
    pose = Pose(60.0, 0.0)
    at = machine_points(GENERIC, pose, np.array([[0.0, 30.0, 5.0]]))[0]
    jog = Jog((float(at[0]), float(at[1]), float(at[2])), -500.0, 1.0)
    for _ in range(5):
        jog = pressed(jog, "r", GENERIC, pose)
    with pytest.raises(MoveError, match="would meet the table"):
        pressed(Jog((jog.at_mm[0], jog.at_mm[1], jog.at_mm[2] - 12.0), -500.0, 1.0), "f", GENERIC, pose)


def test_an_unknown_sign_allows_for_the_mark_on_either_side() -> None:
    unsure = GENERIC.model_copy(update={"uncalibrated": ("machine.tilt.sign",)})
    plan = plan_touches(GENERIC, 20.0)
    steep = max(range(12), key=lambda k: abs(plan.poses[k].tilt_deg))
    assert begin_jog(unsure, plan, steep, 100.0).lowest_mm <= begin_jog(GENERIC, plan, steep, 100.0).lowest_mm


def test_the_command_saves_the_touches_and_leaves_the_machine_level_and_cold(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    real = really(GENERIC, {"point_mm": (0.0, 0.8, -13.0)}, {"point_mm": (0.5, -0.4, 0.0)})
    put_hand_on(monkeypatch, real, MARK)
    with SimulatedPrinter(GENERIC, float("inf")) as printer:
        radius = str(float(np.hypot(*MARK[:2])))
        command = ["calibrate", "--port", printer.path, "--mark-height", "20", "--mark-radius", radius]
        assert main(command) == 0
        assert printer.record.end[-1, 3:5].tolist() == [0.0, 0.0]
        assert (printer.record.nozzle_target_c, printer.record.bed_target_c) == (0.0, 0.0)
    saved = load("generic_ac").machine
    assert saved.turn.point_mm[:2] == pytest.approx((0.5, -0.4), abs=0.02)
    assert saved.tilt.point_mm[1:] == pytest.approx((0.8, -13.0), abs=0.03)
    assert "12, A" in capsys.readouterr().err.replace("touch 12 of 12, ", "12, ")


def test_without_a_terminal_it_is_refused_and_no_port_is_opened(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", "--port", "/dev/nowhere"]) == 1
    assert "--port without --probe takes keys from a terminal, and there is none" in capsys.readouterr().err
    assert not own_folder("machine").exists()
