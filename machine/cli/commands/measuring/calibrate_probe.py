"""Calibration by probe: the machine at a port measures a ball on its plate, from which the axes follow."""

import sys

from machine.cli.commands.measuring.at_port import PrinterProber, ProbingSession, begin_cold, cold_session, tip_raised_after
from machine.cli.commands.measuring.calibrate import MOST_OFF_MM, comparison, refuse_if_saved, save_calibration, tilting_machine
from machine.cli.commands.measuring.questionnaire import read_reply
from machine.cli.terminal.requests import CalibrationRequest
from machine.firmware import dialect_of, firmware_of
from machine.firmware.firmware import ProbingRules
from machine.notices import say, show
from machine.pipeline.output import check_writable
from machine.printing.destination import parse_printer
from machine.setup.calibration.fit import Calibration, calibrate
from machine.setup.calibration.probing import Ball, Measuring, Probe
from machine.setup.calibration.program import calibration_pen, usual_radius_mm
from machine.simulator.contact import ProbedTable, TrueBall
from profiles.errors import PrinterError, ProfileError
from profiles.frozen import Vector
from profiles.machine import Machine
from profiles.profile import Profile

BALL_HEIGHT_MM = 45.0  # height of the ball's centre above the plate
NOISE_MM = 0.005  # noise of the simulated probe
PLACE = (
    "fix a ball {diameter:g} mm in diameter, its centre {height:g} mm over the plate and {radius:g} mm from the middle towards +X"
)


def probe_axes(request: CalibrationRequest, port: str, offset_mm: Vector, profile: Profile) -> int:
    """Measure the ball, show the result and save it. offset_mm: from the nozzle's tip to the probe's contact point.

    Raises UserError after raising the tip; then nothing is saved.
    """
    machine, probing = tilting_machine(request), request.probing
    at = parse_printer(port, probing.baud)
    refuse_if_saved(request)
    if probing.png is not None:
        check_writable(probing.png)
    ball, probe = _ball(request, machine), _probe(offset_mm, machine)
    with cold_session(at, machine, probing.log, _table(machine, ball, probe)) as session:
        prober = PrinterProber(session, calibration_pen(profile), _rules(machine), probe.offset_mm[2])
        measuring = Measuring(machine, ball, prober, probe, say)
        with tip_raised_after(prober):
            _begin(session, prober, machine, ball)
            touches = measuring.run()
    calibration = calibrate(machine, touches, ball.centre_mm[2], directions=True)
    show(
        f"{comparison(machine, calibration, False)}contacts: {measuring.contacts}\n"
        f"{residual_table(calibration, machine, measuring)}"
    )
    if probing.png is not None:
        from machine.pipeline.pictures import residual_picture, write_png

        write_png(probing.png, residual_picture(calibration, [touch.pose for touch in touches], machine))
    if calibration.rms_mm > MOST_OFF_MM and not request.force:
        raise ProfileError(
            f"the contacts are {calibration.rms_mm:.2f} mm off on average, at most {MOST_OFF_MM:g} mm is taken without --force"
        )
    save_calibration(request, machine, calibration)
    return 0


def residual_table(calibration: Calibration, machine: Machine, measuring: Measuring) -> str:
    """Table with a line per pose: deviation of the ball's centre from the fitted machine, mm."""
    rows = [f"{'pose':>18}  {'x':>7}  {'y':>7}  {'z':>7}  mm off"]
    for touch, (x, y, z) in zip(measuring.touches, calibration.errors_mm, strict=True):
        pose = f"{machine.tilt.letter}{touch.pose.tilt_deg:.2f} {machine.turn.letter}{touch.pose.turn_deg:.2f}"
        rows.append(f"{pose:>18}  {x:7.3f}  {y:7.3f}  {z:7.3f}")
    return "\n".join(rows) + "\n"


def _ball(request: CalibrationRequest, machine: Machine) -> Ball:
    height = BALL_HEIGHT_MM if request.mark_height_mm is None else request.mark_height_mm
    radius, diameter = usual_radius_mm(machine, request.mark_radius_mm), request.probing.ball_mm
    if height < 0.5 * diameter:
        raise ProfileError(f"--mark-height {height:g}: a ball {diameter:g} mm in diameter has its centre higher up")
    return Ball(0.5 * diameter, (radius, 0.0, height))


def _probe(offset_mm: Vector, machine: Machine) -> Probe:
    """The nozzle, with the flat end that the profile's silhouette gives, or a probe beside it, which counts as pointed."""
    radius, height = machine.head.silhouette_mm[0]
    own = Probe(offset_mm)
    return Probe(offset_mm, radius if own.is_nozzle and height == 0.0 else 0.0)


def _rules(machine: Machine) -> ProbingRules:
    rules = firmware_of(machine).probing
    if rules is None:
        raise PrinterError(
            f"{machine.name}: how {dialect_of(machine).firmware} probes is not known: touch a mark by hand instead"
        )
    return rules


def _table(machine: Machine, ball: Ball, probe: Probe) -> ProbedTable:
    """Contents of a simulated printer's plate."""
    there = TrueBall(ball.radius_mm, ball.centre_mm)
    return ProbedTable(machine, there, offset_mm=probe.offset_mm, flat_mm=probe.flat_mm, noise_mm=NOISE_MM)


def _begin(session: ProbingSession, prober: PrinterProber, machine: Machine, ball: Ball) -> None:
    """Prepare the cold, homed machine, and wait until the user confirms that the ball is in place."""
    begin_cold(session, prober, machine)
    if not _rules(machine).limited:
        say(f"{dialect_of(machine).firmware} probes down to the axis' end where nothing is met: keep a hand at the switch")
    place = PLACE.format(diameter=2.0 * ball.radius_mm, height=ball.centre_mm[2], radius=ball.centre_mm[0])
    say(place)
    if sys.stdin.isatty():
        session.exchange.drain()
        read_reply("Enter when it stands there, Ctrl-C ends: ", "the ball stood there")
