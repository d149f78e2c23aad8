"""Fault scripts: each fault occurs where the script says, once or by chance, and a bad file is refused with a sentence."""

import re
from itertools import islice, takewhile
from math import inf
from pathlib import Path
from time import sleep

import pytest
from hypothesis import given
from hypothesis import strategies as st

from machine.link.port import Port, open_port
from machine.simulator import faults
from machine.simulator.board import BuildOptions
from machine.simulator.cable import Cable
from machine.simulator.faults import KINDS, Fault, FaultScript, Kind, read_script
from machine.simulator.firmware import SimulatedFirmware
from machine.simulator.simulator import SimulatedPrinter
from profiles.errors import PortError, PrinterError
from profiles.profile import load
from tests.machine.virtual_printer import random_script

MACHINE = load().machine
PLAIN = BuildOptions(advanced_ok=False)


class Heard(SimulatedFirmware):
    """A firmware that records the bytes it receives."""

    def __init__(self) -> None:
        super().__init__(MACHINE, PLAIN)
        self.heard = b""

    def receive(self, data: bytes) -> None:
        self.heard += data
        super().receive(data)


def answers(*faults: Fault, lines: int = 3, now_s: float = 0.0) -> bytes:
    """The bytes that the host receives in answer to a number of G21."""
    return Cable(SimulatedFirmware(MACHINE, PLAIN), FaultScript(faults)).exchange(b"G21\n" * lines, now_s)


@pytest.mark.parametrize(
    "portions", [(b"abcdefgh\n",), (b"a", b"bcd", b"e", b"", b"fgh\n"), tuple(b"%c" % c for c in b"abcdefgh\n")]
)
def test_byte_faults_hit_their_bytes_however_the_bytes_come(portions: tuple[bytes, ...]) -> None:
    firmware = Heard()
    cable = Cable(firmware, FaultScript((Fault("flip", 4, value=0), Fault("duplicate", 6), Fault("drop", 1))))
    for portion in portions:
        cable.exchange(portion)
    assert firmware.heard == b"acddfggh\n"


def test_answers_bytes_are_counted_apart_from_commands_bytes() -> None:
    assert answers(Fault("drop", 1, to_host=True)) == b"o\nok\nok\n"


def test_garbage_is_inserted_in_the_direction_of_its_bytes() -> None:
    firmware = Heard()
    assert Cable(firmware, FaultScript((Fault("garbage", 2, unit="byte", text="xx"),))).exchange(b"G21\n") != b"ok\n"
    assert firmware.heard == b"G2xx1\n"


def test_delayed_bytes_come_later_and_in_order() -> None:
    cable = Cable(SimulatedFirmware(MACHINE, PLAIN), FaultScript((Fault("delay", 4, seconds=2.0),)))
    assert cable.exchange(b"G21\nG21\n", now_s=1.0) == b"ok\n"
    assert cable.exchange(b"M105\n", now_s=2.9) == b""
    assert cable.exchange(b"", now_s=cable.due_s(2.9)).startswith(b"ok\nok T:")


@pytest.mark.parametrize(
    ("kind", "heard"), [("swallow ok", b"ok\nok\n"), ("truncate ok", b"ok\no\nok\n"), ("double ok", b"ok\n" * 4)]
)
def test_an_ok_is_lost_cut_or_said_twice(kind: Kind, heard: bytes) -> None:
    assert answers(Fault(kind, 2)) == heard


def test_the_first_ok_from_that_answer_on_is_meant() -> None:
    cable = Cable(SimulatedFirmware(MACHINE, PLAIN), FaultScript((Fault("swallow ok", 1),)))
    assert cable.exchange(b"M114\nG21\n").splitlines()[1:] == [b"ok"]


@pytest.mark.parametrize(("fault", "heard"), [
    (Fault("spurious resend", 2, value=7), b"ok\nResend: 7\nok\nok\nok\n"),
    (Fault("error", 3), b"ok\nok\nError:Heating failed, system stopped! Heater_ID: 0\nok\n"),
    (Fault("error", 3, text="!! Lost"), b"ok\nok\n!! Lost\nok\n"),
    (Fault("garbage", 2, text="\xff\xfe"), b"ok\n\xff\xfeok\nok\n"),
    (Fault("garbage", 4, True, unit="byte", text="x"), b"ok\noxk\nok\n"),
    (Fault("stall", 2), b"ok\n"),
    (Fault("disconnect", 3), b"ok\nok\n"),
    (Fault("disconnect", 2, unit="answer"), b"ok\n"),
])  # fmt: skip
def test_a_moment_comes_before_the_line_answer_or_byte_it_names(fault: Fault, heard: bytes) -> None:
    if fault.kind == "disconnect":
        cable = Cable(SimulatedFirmware(MACHINE, PLAIN), FaultScript((fault,)))
        cable.exchange(b"G21\n" * 3)
        assert not cable.connected(1e9)
    else:
        assert answers(fault) == heard


def test_a_reset_at_a_line_forgets_that_line_and_greets() -> None:
    said = answers(Fault("reset", 2)).decode().splitlines()
    assert said[:2] == ["ok", "start"]
    assert "ok" not in said[2:]


def test_a_silent_reset_says_nothing_and_asks_for_line_one() -> None:
    cable = Cable(SimulatedFirmware(MACHINE, PLAIN), FaultScript((Fault("silent reset", 3),)))
    cable.exchange(b"N1 G21*18\nN2 G21*17\nN3 G21*16\n")
    assert b"Resend: 1\n" in cable.exchange(b"N4 G21*23\n")


def test_a_thermal_runaway_is_said_and_then_there_is_silence() -> None:
    cable = Cable(SimulatedFirmware(MACHINE, PLAIN), FaultScript((Fault("thermal runaway", 2),)))
    assert b"Error:Thermal Runaway, system stopped! Heater_ID: 0\nError:Printer halted. kill() called!\n" in cable.exchange(
        b"G21\n" * 4
    )
    assert cable.exchange(b"M105\n") == b""


def test_a_stall_ends_with_all_answers_at_once() -> None:
    cable = Cable(SimulatedFirmware(MACHINE, PLAIN), FaultScript((Fault("stall", 1, seconds=3.0),)))
    assert [cable.exchange(b"G21\n", now_s) for now_s in (0.0, 1.0, 2.9, 3.0)] == [b"", b"", b"", b"ok\n" * 4]


def test_a_blocked_printer_reads_later_what_waits() -> None:
    cable = Cable(SimulatedFirmware(MACHINE, PLAIN), FaultScript((Fault("block", 2, seconds=5.0),)))
    assert cable.exchange(b"G21\nG21\n") == b"ok\n"
    assert cable.blocked(4.0)
    assert cable.exchange(b"G21\n", 4.0) == b""
    assert (cable.exchange(b"", 5.0), cable.blocked(5.0)) == (b"ok\nok\n", False)


def test_a_cable_that_is_out_carries_nothing_until_it_is_back() -> None:
    cable = Cable(SimulatedFirmware(MACHINE, PLAIN), FaultScript((Fault("disconnect", 1, seconds=2.0),)))
    assert cable.exchange(b"G21\n", 1.0) == b""
    assert (cable.connected(1.0), cable.exchange(b"G21\n", 1.5), cable.due_s(1.5)) == (False, b"", 3.0)
    assert (cable.connected(3.0), cable.exchange(b"G21\n", 3.0)) == (True, b"ok\n")


@given(st.integers(0, 10**6), st.floats(0.001, 1.0))
def test_chance_strikes_as_often_as_it_says_and_the_same_for_a_seed(seed: int, chance: float) -> None:
    script = FaultScript((Fault("drop", chance=chance),), seed)
    struck = len(list(takewhile(lambda count: count < 20000, script.strikes(0))))
    assert abs(struck - 20000 * chance) <= 6 * (20000 * chance * (1 - chance)) ** 0.5 + 1
    assert list(islice(script.strikes(0), 50)) == list(islice(script.strikes(0), 50))


def test_a_random_script_is_the_same_for_a_seed_and_knows_all_kinds() -> None:
    assert random_script(1, 5, range(3, 99)) == random_script(1, 5, range(3, 99)) != random_script(2, 5, range(3, 99))
    assert {fault.kind for fault in random_script(1, 500, range(3, 99)).faults} == set(KINDS)


FILE = """
seed = 7
[[fault]]
kind = "flip"
byte = 900
to = "host"
bit = 3
[[fault]]
kind = "swallow ok"
chance = 0.01
[[fault]]
kind = "disconnect"
line = 300
seconds = 2
"""


def test_a_script_is_read_from_a_file(tmp_path: Path) -> None:
    (tmp_path / "faults.toml").write_text(FILE)
    assert read_script(tmp_path / "faults.toml") == FaultScript(
        (
            Fault("flip", 900, True, 3, unit="byte"),
            Fault("swallow ok", chance=0.01),
            Fault("disconnect", 300, unit="line", seconds=2.0),
        ),
        7,
    )


def test_the_page_s_example_is_a_script_and_the_docstring_has_all_kinds(tmp_path: Path) -> None:
    page = (Path(__file__).parents[3] / "CONTRIBUTING.md").read_text(encoding="utf-8")
    (example,) = (text for text in re.findall(r"```toml\n(.*?)```", page, re.DOTALL) if "[[fault]]" in text)
    (tmp_path / "faults.toml").write_text(example)
    assert [fault.kind for fault in read_script(tmp_path / "faults.toml").faults] == ["flip", "disconnect"]
    assert all(f"`{kind}`" in str(faults.__doc__) for kind in KINDS)


@pytest.mark.parametrize(("text", "words"), [
    ("x = 1", "x is not known: seed and"),
    ("seed = 1.5", "seed is 1.5: a whole number"),
    ("seed = ", "is not TOML"),
    ("fault = 3", "fault is 3: tables headed"),
    ("[[fault]]\nline = 1", "fault 1: kind is missing: drop, flip"),
    ('[[fault]]\nkind = "melt"', "kind is 'melt': drop, flip"),
    ('[[fault]]\nkind = "drop"', "'drop' has no place: one of byte, chance is allowed"),
    ('[[fault]]\nkind = "reset"\nline = 3\nchance = 0.1', "'reset' has line and chance: one of line, byte, answer, chance"),
    ('[[fault]]\nkind = "drop"\nline = 3', "line is not a key of 'drop': kind, byte, chance, to are allowed"),
    ('[[fault]]\nkind = "reset"\nline = 0', "line is 0: a whole number from 1 up"),
    ('[[fault]]\nkind = "flip"\nbyte = 0\nbit = 8', "bit is 8: a whole number from 0 to 7"),
    ('[[fault]]\nkind = "flip"\nbyte = true', "byte is True: a whole number from 0 up"),
    ('[[fault]]\nkind = "flip"\nchance = 1.5', "chance is 1.5: a number above 0, at most 1"),
    ('[[fault]]\nkind = "flip"\nchance = nan', "chance is nan: a number above 0"),
    ('[[fault]]\nkind = "delay"\nbyte = 1', "seconds is missing: a number of seconds from 0 up is"),
    ('[[fault]]\nkind = "stall"\nline = 1\nseconds = -1', "seconds is -1: a number of seconds from 0 up, inf for ever"),
    ('[[fault]]\nkind = "drop"\nbyte = 1\nto = "me"', "to is 'me': printer, host"),
    ('[[fault]]\nkind = "error"\nline = 1\ntext = "\u20ac"', "text is '\u20ac': text of characters up to"),
])  # fmt: skip
def test_a_bad_script_is_refused_with_one_sentence(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "faults.toml").write_text(text, encoding="utf-8")
    with pytest.raises(PrinterError) as caught:
        read_script(tmp_path / "faults.toml")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_script_that_is_not_there_is_named() -> None:
    with pytest.raises(PrinterError, match=r"fault script none.toml cannot be read: no such file"):
        read_script(Path("none.toml"))


def test_a_fault_has_one_place() -> None:
    for at, chance in ((None, 0.0), (3, 0.5)):
        with pytest.raises(ValueError, match="either at or chance"):
            Fault("drop", at, chance=chance)


def _read_for_ever(port: Port) -> None:
    while True:
        port.read()


def test_a_cable_pulled_out_and_put_back_is_a_terminal_gone_and_back(tmp_path: Path) -> None:
    link = tmp_path / "printer"
    with SimulatedPrinter(MACHINE, faults=[Fault("disconnect", 1, seconds=0.3)], at=link) as printer:
        with open_port(printer.path, 115200) as port:
            port.write(b"G21\n")
            with pytest.raises(PortError, match="was lost"):
                _read_for_ever(port)
        while not link.exists():
            sleep(0.01)
        with open_port(str(link), 115200) as port:
            port.write(b"G21\n")
            while not (said := port.read()):
                continue
            assert said.startswith(b"ok")
    assert not link.is_symlink()
    assert printer.record.lines == 2


def test_a_file_that_is_not_a_link_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "mine").write_text("x")
    with pytest.raises(PortError, match="mine exists and is not a link"), SimulatedPrinter(MACHINE, at=tmp_path / "mine"):
        pass
    assert (tmp_path / "mine").read_text() == "x"


def test_a_fault_given_in_seconds_lasts_unless_limited() -> None:
    assert Fault("stall", 1).seconds == inf
