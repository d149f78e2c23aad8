"""Modes: the dry run's reader, the host and the simulated printer interpret the same words as the same moves in every dialect."""

from dataclasses import dataclass, field
from math import inf

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from machine.firmware import dialect_of, dialects
from machine.gcode.modes import E_AXIS, ModalState, axes_of
from machine.gcode.reader.parse import parse_gcode
from machine.simulator.firmware import SimulatedFirmware
from profiles.machine import Machine
from tests.machine.firmware.test_dialects import profile

MACHINES = {name: profile(name).machine for name in dialects()}
EACH = pytest.mark.parametrize("dialect", MACHINES)
Place = list[float]


def from_zero(machine: Machine) -> list[str]:
    """The beginning of a program that sets every axis it can name to 0."""
    return ["G21", "G90", "M82", "G92 " + " ".join(f"{letter}0" for letter in axes_of(machine).words), "G1 F600"]


def read_by_dry_run(lines: list[str], machine: Machine) -> list[Place]:
    """X Y Z tilt turn and the filament pushed at each move."""
    parsed = parse_gcode(lines, machine)
    return np.column_stack([parsed.end, parsed.e_mm]).tolist()


def read_by_host(lines: list[str], machine: Machine) -> list[Place]:
    modal, places = ModalState(axes_of(machine)), []
    for line in lines:
        before = modal.at[E_AXIS] or 0.0
        if modal.take(line):
            *coordinates, filament_mm = (coordinate or 0.0 for coordinate in modal.at)
            places.append([*coordinates, filament_mm - before])
    return places


def read_by_simulator(lines: list[str], machine: Machine) -> list[Place]:
    firmware, places = SimulatedFirmware(machine), []
    motion = firmware.board.motion
    firmware.board.cold_allowed, motion.limits = True, [(-inf, inf)] * 5
    for line in lines:
        before, moves = motion.position[E_AXIS], line[:2] in ("G0", "G1") and "F" not in line
        firmware.receive(f"{line}\n".encode())
        firmware.advance(inf)
        if moves:
            places.append([*motion.coordinates()[:E_AXIS], motion.position[E_AXIS] - before])
    return places


READERS = (read_by_dry_run, read_by_host, read_by_simulator)


@pytest.mark.parametrize("read", READERS)
@pytest.mark.parametrize(
    ("dialect", "text", "pushed_mm"),
    [
        ("marlin", "G91|G1 E1|G1 E1|G90|G1 E5", [1, 1, 3]),
        ("marlin", "M83|G90|G1 E5|G1 E6", [5, 1]),
        ("reprapfirmware", "G91|G1 E1|G1 E1|G90|G1 E5", [1, 0, 4]),
        ("reprapfirmware", "M83|G90|G1 E5|G1 E6", [5, 6]),
        ("klipper", "G91|G1 E1|G1 E1|G90|G1 E5", [1, 1, 3]),
        ("klipper", "M83|G90|G1 E5|G1 E6", [5, 6]),
        ("klipper", "M83|G91|G90|M82|G1 E6", [6]),
        ("klipper", "G1 E4|G92|G1 E6", [4, 6]),
        ("marlin", "G1 E4|G92|G1 E6", [4, 2]),
        ("reprapfirmware", "G1 E4|G92|G1 E6", [4, 2]),
        ("marlin", "G1 E4|G92 E1|G1 E6", [4, 5]),
        ("marlin", "G20|G1 E1|G21|G1 E26.4", [25.4, 1.0]),
        ("marlin", "G1 X1E5", [5]),
    ],
)
def test_how_much_filament_an_e_word_pushes(read, dialect: str, text: str, pushed_mm: list[float]) -> None:
    machine = MACHINES[dialect]
    places = read([*from_zero(machine), *text.split("|")], machine)
    assert [coordinates[E_AXIS] for coordinates in places] == pytest.approx(pushed_mm)


@dataclass
class Model:
    """A minimal firmware: one number per axis, one line per rule."""

    machine: Machine
    at: dict[str, float] = field(default_factory=dict)
    unit: float = 1.0
    relative: bool = False
    filament_relative: bool = False

    def take(self, name: str, words: list[tuple[str, float]]) -> Place | None:
        rule, axes = dialect_of(self.machine), axes_of(self.machine).words
        before = dict.fromkeys(axes, 0.0) | self.at
        if name in ("G20", "G21"):
            self.unit = 25.4 if name == "G20" else 1.0
        elif name in ("M82", "M83"):
            self.filament_relative = name == "M83"
        elif name in ("G90", "G91"):
            self.relative = name == "G91"
            self.filament_relative = self.relative if rule.filament_mode == "set" else self.filament_relative
        for letter, value in words or [(letter, 0.0) for letter in axes if name == "G92" and rule.bare_g92]:
            length = value * (self.unit if axes[letter] not in (3, 4) else 1.0)
            steps = self.relative
            if axes[letter] == E_AXIS:
                steps = self.filament_relative or (self.relative and rule.filament_mode == "carried")
            self.at[letter] = length + (before[letter] if steps and name != "G92" else 0.0)
        if name not in ("G0", "G1"):
            return None
        coordinates = dict.fromkeys(range(6), 0.0) | {axis: self.at.get(letter, 0.0) for letter, axis in axes.items()}
        filament = next(letter for letter, axis in axes.items() if axis == E_AXIS)
        return [*(coordinates[axis] for axis in range(E_AXIS)), self.at.get(filament, 0.0) - before[filament]]


@st.composite
def commands(draw: st.DrawFn, machine: Machine) -> list[tuple[str, list[tuple[str, float]]]]:
    letters = list(axes_of(machine).words)
    values = st.integers(-9999, 9999).map(lambda thousandths: thousandths / 1000)
    words = st.dictionaries(st.sampled_from(letters), values, min_size=1, max_size=6).map(lambda chosen: list(chosen.items()))
    modes = st.tuples(st.sampled_from(["G20", "G21", "G90", "G91", "M82", "M83", "G92"]), st.just([]))
    moves = st.tuples(st.sampled_from(["G0", "G1", "G1", "G1", "G92"]), words)
    return draw(st.lists(modes | moves, min_size=1, max_size=25))


@EACH
@settings(deadline=None, max_examples=60)
@given(data=st.data())
def test_all_readers_agree_on_any_sequence_of_modes_and_moves(dialect: str, data: st.DataObject) -> None:
    machine = MACHINES[dialect]
    model, blank = Model(machine), data.draw(st.sampled_from([" ", ""]))
    sequence = data.draw(commands(machine))
    lines = from_zero(machine) + [
        blank.join([name, *(f"{letter}{value:.3f}" for letter, value in words)]) for name, words in sequence
    ]
    expected = [coordinates for name, words in sequence if (coordinates := model.take(name, words)) is not None]
    for read in READERS:
        assert np.array(read(lines, machine)) == pytest.approx(np.array(expected), abs=1e-6), read.__name__


@pytest.mark.parametrize("line", ["g1 x5 y6.5", "G01X5Y6.5", "G1 X5Y6.5", "G1 X 5 Y 6.5", "G1 Y+6.500 X5."])
def test_the_host_reads_a_move_however_it_is_spelled(line: str) -> None:
    modal = ModalState(axes_of(None))
    assert modal.take(line)
    assert modal.at[:2] == [5.0, 6.5]


@pytest.mark.parametrize(("word", "x"), [("Xinf", None), ("Xnan", None), ("X" + "9" * 13, None), ("X1_0", 1.0), ("X1E5", 1.0)])
def test_the_host_takes_nothing_but_bounded_numbers(word: str, x: float | None) -> None:
    modal = ModalState(axes_of(None))
    modal.take(f"G1 {word}")
    assert modal.at[0] == x


def test_a_feed_set_in_millimetres_is_restored_in_inches() -> None:
    modal = ModalState(axes_of(None))
    for command in ("G21", "G1 F2540", "G20"):
        modal.take(command)
    assert "G1 F100" in modal.lines()
