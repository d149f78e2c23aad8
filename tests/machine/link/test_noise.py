"""Sender and firmware joined in memory with virtual clocks: many noisy, repeatable prints in a short time."""

import random

import numpy as np
import pytest

from machine.link.protocol.connection import Connection
from machine.link.protocol.states import State
from machine.link.stream import print_lines
from machine.simulator.board import BuildOptions
from machine.simulator.cable import Cable
from machine.simulator.firmware import SimulatedFirmware
from machine.simulator.simulator import SimulatedPrinter
from profiles.errors import PrinterError
from profiles.profile import load
from tests.machine.virtual_printer import HEALED, random_script

MACHINE = load().machine
MOVES = [f"G1 X{1 + i % 90}.{i:05d} Y{i % 70}.5 E0.{1 + i:05d} F3000" for i in range(300)]
PROGRAM = ["M83", "M104 S200", "M109 S200", *MOVES, "M400", "M105"]
WANTED = np.array([[float(word[1:]) for word in line.split()[1:4]] for line in MOVES])
DOUBLED = {6}  # seeds whose faults double the ok of a damaged line: this cannot be recovered, and it is reported


def noisy_print(seed: int, faults: int, torn: bool) -> tuple[PrinterError | None, np.ndarray]:
    """The error that ended a print, if any, and the X, Y and filament of its moves; torn: bytes arrive in portions."""
    rng, now_s = random.Random(seed), 0.0
    build = BuildOptions(advanced_ok=seed % 2 == 0, emergency_parser=seed % 3 > 0, busy=seed % 5 > 0)
    firmware, connection, left = SimulatedFirmware(MACHINE, build), Connection(), list(reversed(PROGRAM))
    cable = Cable(firmware, random_script(seed, faults, range(60, 300), HEALED, 30))
    while left or connection.window.acknowledged < connection.window.sent or connection.state is not State.OPEN:
        assert now_s < 3600, "this print hangs"
        while left and connection.can_send(left[-1]):
            connection.send(left.pop(), now_s)
        heard = b""
        for portion in _portions(connection.take(), rng if torn else None):
            heard += cable.exchange(portion, now_s)
        now_s += 0.001 if heard else 0.05
        for portion in _portions(heard, rng):
            connection.receive(portion, now_s)
        connection.tick(now_s)
        if connection.fault is not None:
            break
    record = firmware.record()
    return connection.fault, np.column_stack([record.end[:, :2], record.end[:, 5] - record.start[:, 5]])


def _portions(data: bytes, rng: random.Random | None) -> list[bytes]:
    cut = rng.randrange(len(data) + 1) if rng else 0
    return [portion for portion in (data[:cut], data[cut:]) if portion]


@pytest.mark.parametrize("seed", range(40))
def test_eight_faults_in_three_hundred_lines_are_healed_whole(seed: int) -> None:
    error, moves = noisy_print(seed, 8, torn=False)
    assert (error is not None) == (seed in DOUBLED)
    assert "its effect is unknown" in str(error) or len(moves) == len(WANTED)
    assert moves == pytest.approx(WANTED[: len(moves)], abs=1e-6)


@pytest.mark.parametrize("seed", range(40, 60))
def test_torn_portions_end_in_the_exact_moves_or_in_an_error(seed: int) -> None:
    error, moves = noisy_print(seed, 8, torn=True)
    assert error is not None or len(moves) == len(WANTED)
    assert moves == pytest.approx(WANTED[: len(moves)], abs=1e-6)


def test_the_window_never_fills_the_ring_of_a_uart() -> None:
    with SimulatedPrinter(MACHINE, speed=20.0, build=BuildOptions(rx_ring=128)) as printer:
        outcome = print_lines(["G1 X5 F6000", "G1 X0"] * 150, printer.path, 250000)
        record = printer.record
    assert (record.lost_bytes, outcome.repeated, len(record.end)) == (0, 0, 300)
