"""What a prober makes of the firmware's words, and that it never goes down to get away."""

import pytest

from machine.cli.commands.measuring.at_port import PrinterProber
from machine.firmware import firmware_of
from machine.setup.calibration.program import calibration_pen
from profiles.errors import FirmwareError, PrinterError
from profiles.profile import load


class Session:
    """A printer that answers every command with the same words."""

    def __init__(self, *answers: str, error: str = "") -> None:
        self.answers, self.error = answers, error
        self.heard: list[str] = []
        self.unknown: list[str] = []
        self.said: list[str] = []

    def command(self, line: str) -> None:
        self.said.append(line)
        self.heard += self.answers
        if self.error:
            raise FirmwareError(self.error)


def prober(session: Session, offset_z_mm: float = 0.0) -> PrinterProber:
    profile = load("fractal5pro")
    rules = firmware_of(profile.machine).probing
    assert rules is not None
    return PrinterProber(session, calibration_pen(profile), rules, offset_z_mm)  # type: ignore[arg-type]


def test_older_klipper_says_where_the_tip_was() -> None:
    assert prober(Session("probe at 10.000,20.000 is z=3.912500", "Result is z=3.912500"), -1.5).seek(0.0) == 3.9125


def test_klipper_of_today_says_where_the_bed_is_its_own_offset_taken_off() -> None:
    session = Session(
        "probe: at 10.000,20.000 bed will contact at z=2.4", "Result: at 10.000,20.000 estimate contact at z=2.400000"
    )
    assert prober(session, -1.5).seek(0.0) == pytest.approx(3.9)


def test_an_answer_that_is_none_is_no_contact() -> None:
    with pytest.raises(PrinterError, match="'probe: open' is not understood"):
        prober(Session("probe: open")).seek(0.0)


def test_nothing_met_is_none_and_any_other_error_is_the_firmware_s() -> None:
    assert prober(Session(error="!! No trigger on probe after full movement")).seek(0.0) is None
    with pytest.raises(FirmwareError, match="Must home before probe"):
        prober(Session(error="!! Must home before probe")).seek(0.0)


def test_a_tip_that_was_never_sent_anywhere_is_not_moved_to_get_away() -> None:
    session = Session()
    prober(session).retreat()
    assert session.said == []
