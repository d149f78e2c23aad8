"""Campaign of calibrations: every shipped machine, misaligned at random, measures a ball on its own plate.

    python -m tools.campaign_calibration [--runs N] [--noise MM] [--machines NAME...] [--printers N] [--touches N] [--pieces N]

A machine's centres are up to 2 mm, its zero and the directions of its axes up to 1 degree from the profile's, its signs any, and
the ball stands up to 2 mm from where it is told. Per machine: how many of the runs end with a mean residual of at most
0.05 mm, the residual and the error of what is predicted over the measured reach that 99 of 100 runs keep, and how near the tip
comes to table and ball outside of probing. --printers: how many runs of each streamed machine go through its simulated
firmware. --touches: how many runs of the fit alone, from touches with 0.02 mm noise at thirty poses.
--pieces: how many machines whose centres are up to 0.4 mm and whose zero is up to 0.4 degrees off print `demo:calibration` up to
three times: how far its pads lie aside before, and after each piece.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from machine.cli.commands.measuring.at_port import PrinterProber, ProbingSession
from machine.firmware import dialect_of, firmware_of
from machine.kinematics.table import machine_points
from machine.setup.calibration.fit import calibrate
from machine.setup.calibration.piece import Piece, correct
from machine.setup.calibration.probing import AROUND, WIDE, Measuring, contact_heights, find_in_the_way
from machine.setup.calibration.program import calibration_pen
from machine.simulator.contact import ProbedTable
from mdp.mesh import Floats
from mdp.pose import Pose
from profiles.errors import UserError
from profiles.machine import Machine
from profiles.profile import load, shipped
from tests.machine.setup.calibration.direct import HEIGHT_MM, DirectProber, probed
from tests.machine.setup.calibration.misaligned import prediction_errors_mm
from tests.machine.setup.calibration.pieces import off, read_off, seam_mm, standing
from tests.machine.setup.calibration.test_directions import worst_predictions_mm
from tests.machine.virtual_printer import PATH, VirtualPrinter

MOST_MM, FLAT_MM = 0.05, 0.5
SHARE = 0.99
PIECES, STEEP_DEG = 3, 60.0
LEANS_DEG = dict.fromkeys(("gen5x", "open5x_jubilee", "open5x_prusa_i3", "open5x_voron0"), 30.0)  # they print calibration30


@dataclass(frozen=True)
class Run:
    """One calibration, mm: mean and worst residual, mean and worst error of prediction, nearest approach; contacts, and poses
    at which the head keeps less than its clearance."""

    residual_mm: float
    worst_mm: float
    predicted_mm: float
    worst_predicted_mm: float
    nearest_mm: float
    contacts: int
    tight: int
    signs: bool


def directly(machine: Machine, seed: int, noise_mm: float) -> Run:
    """One run without a firmware in between."""
    measuring, prober = probed(machine, seed, noise_mm, flat_mm=FLAT_MM)
    measuring.run()
    return _judged(machine, measuring, prober.table, prober.least_mm, seed)


def by_firmware(machine: Machine, seed: int, noise_mm: float) -> Run:
    """One run over the protocol of the machine's simulated firmware, in virtual time."""
    measuring, direct = probed(machine, seed, noise_mm, flat_mm=FLAT_MM)
    printer = VirtualPrinter(machine, table=direct.table)
    session = ProbingSession(printer.medium.open(PATH, 0), dialect_of(machine).longest_line, printer.medium)
    session.greet()
    rules = firmware_of(machine).probing
    assert rules is not None
    profile = load().model_copy(update={"machine": machine})
    prober = PrinterProber(session, calibration_pen(profile), rules)
    prober.start()
    prober.rise(machine.z.limits_mm[1])
    measuring.prober = prober
    measuring.run()
    record = printer.record
    nearest = _nearest_mm(direct, record.start, record.end)
    return _judged(machine, measuring, direct.table, nearest, seed)


def _nearest_mm(direct: DirectProber, start: Floats, end: Floats) -> float:
    """How near the tip of executed moves comes to what stands there, those straight down or up left out."""
    for begin, finish in zip(start[:, :5].tolist(), end[:, :5].tolist(), strict=True):
        if begin[:2] != finish[:2] or begin[3:] != finish[3:]:
            direct.at = begin
            direct._go(finish)
    return direct.least_mm


def _judged(machine: Machine, measuring: Measuring, table: ProbedTable, nearest_mm: float, seed: int) -> Run:
    real, touches = table.machine, measuring.touches
    found = calibrate(machine, touches, HEIGHT_MM, directions=True)
    tilts = [touch.pose.tilt_deg for touch in touches]
    radius = float(np.hypot(*measuring.ball.centre_mm[:2]))
    random = np.random.default_rng(seed)
    errors = prediction_errors_mm(found.machine, real, radius, HEIGHT_MM, (min(tilts), max(tilts)), random)
    return Run(
        found.rms_mm,
        max(found.residuals_mm),
        float(np.sqrt(np.mean(errors**2))),
        float(errors.max()),
        nearest_mm,
        measuring.contacts,
        sum(_is_tight(real, touch.pose, measuring, table) for touch in touches),
        (found.machine.tilt.sign, found.machine.turn.sign) == (real.tilt.sign, real.turn.sign),
    )


def _is_tight(real: Machine, pose: Pose, measuring: Measuring, table: ProbedTable) -> bool:
    """Whether the real machine's head keeps less than its clearance from table, cradle or ball while the ball is touched."""
    assert table.ball is not None
    ball = table.ball
    centre = machine_points(real, pose, np.array([ball.centre_mm]))[0]
    places = centre[:2] + WIDE * ball.radius_mm * AROUND
    tips = np.column_stack([places, contact_heights(centre, ball.radius_mm, table.flat_mm, places)])
    stands = type(measuring.ball)(ball.radius_mm, ball.centre_mm)
    return find_in_the_way(real, pose, stands, tips, True) is not None


def campaign(name: str, runs: int, noise_mm: float, way: Callable[[Machine, int, float], Run]) -> str:
    """One line of the table."""
    machine, done, failed, began_s = load(name).machine, list[Run](), list[str](), time.process_time()
    for seed in range(runs):
        try:
            done.append(way(machine, seed, noise_mm))
        except UserError as error:
            failed.append(f"seed {seed}: {error}")
    good = sum(run.residual_mm <= MOST_MM and run.signs for run in done)
    columns = [[getattr(run, key) for run in done] for key in ("residual_mm", "worst_mm", "predicted_mm", "worst_predicted_mm")]
    figures = " | ".join(f"{np.quantile(column, SHARE):.3f}" for column in columns) if done else "- | - | - | -"
    nearest = min((run.nearest_mm for run in done), default=np.nan)
    contacts = int(np.mean([run.contacts for run in done])) if done else 0
    tight, seconds = sum(run.tight for run in done), (time.process_time() - began_s) / runs
    row = f"| {name} | {good}/{runs} | {figures} | {nearest:.2f} | {tight} | {contacts} | {seconds:.2f} |"
    return "\n".join([row, *(f"  {sentence}" for sentence in failed[:3])])


def printed_pieces(name: str, runs: int) -> str:
    """How far pads lie aside before and after readings of one, two and three pieces."""
    machine, random, rows = load(name).machine, np.random.default_rng(0), []
    for _ in range(runs):
        true, found, pieces, readings, row = off(machine, random), machine, list[Piece](), list[Floats](), list[float]()
        for _ in range(PIECES):
            pieces.append(replace(standing(machine, LEANS_DEG.get(name, STEEP_DEG)), machine=found))
            row.append(seam_mm(pieces[0], found, true))
            readings.append(read_off(pieces[-1].laid_aside_mm(true), random))
            found = correct(machine, pieces, np.array(readings)).machine
        rows.append([*row, seam_mm(pieces[0], found, true)])
    columns = [" ".join(f"{np.quantile(column, share):.2f}" for share in (0.5, 0.95, 1.0)) for column in np.array(rows).T]
    return f"| {name} | {' | '.join(columns)} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--noise", type=float, default=0.01, help="mm, one sigma of a contact's height")
    parser.add_argument("--machines", nargs="*", default=[name for name in shipped("machine") if load(name).machine.tilts])
    parser.add_argument("--printers", type=int, default=0)
    parser.add_argument("--touches", type=int, default=0)
    parser.add_argument("--pieces", type=int, default=0)
    given = parser.parse_args()
    if given.pieces:
        print("| machine | pads aside, mm: median, 95 %, worst | after one piece | two | three |\n|---|---|---|---|---|")
        for name in given.machines:
            print(printed_pieces(name, given.pieces), flush=True)
    if not given.runs and not given.printers and not given.touches:
        return
    if given.touches:
        worst = worst_predictions_mm(range(given.touches))
        good = sum(value < MOST_MM for value in worst)
        print(
            f"touches alone: {good} of {given.touches} runs predict the reach to {MOST_MM:g} mm, the worst to {max(worst):.3f} mm"
        )
    print(f"{given.noise:g} mm noise; 99 of 100 runs keep:")
    print(
        "| machine | residual <= 0.05 mm | mean residual | worst | mean prediction | worst | nearest mm | tight | contacts | s |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    for name in given.machines:
        if given.runs:
            print(campaign(name, given.runs, given.noise, directly), flush=True)
        if given.printers and firmware_of(load(name).machine).probing is not None:
            print(campaign(f"{name}", given.printers, given.noise, by_firmware) + " by firmware", flush=True)


if __name__ == "__main__":
    main()
