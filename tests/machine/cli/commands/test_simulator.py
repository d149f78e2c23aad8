"""`tiltprint simulator` from the user's side: a path to open, an end with Ctrl-C, and refusals."""

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import serial

from machine.cli.cli import main
from machine.cli.commands.simulator import read_build_options
from machine.simulator.board import BuildOptions
from profiles.errors import PrinterError
from tests.machine.peers import PATIENCE_S


@contextmanager
def running(*options: str) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """The command in a process of its own, and the first line that it prints."""
    command = [sys.executable, "-m", "machine.cli.cli", "simulator", *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().strip(), process
        finally:
            process.kill()


def ended(process: subprocess.Popen[str], number: signal.Signals = signal.SIGINT) -> tuple[int, str]:
    """Exit code and the rest of the output."""
    process.send_signal(number)
    output, _ = process.communicate(timeout=PATIENCE_S)
    return process.returncode, output


def talk(path: str, text: bytes, until: bytes) -> bytes:
    with serial.serial_for_url(path, 115200, timeout=PATIENCE_S) as host:
        host.write(text)
        return host.read_until(until)


def test_it_keeps_a_link_while_it_runs_and_sums_up_at_the_end(tmp_path: Path) -> None:
    link = tmp_path / "printer"
    with running("--pty", str(link), "--speed", "0") as (path, process):
        assert (path, link.is_symlink()) == (str(link), True)
        assert b"area:" in talk(path, b"G1 X10 F600\nG0 A200\nG77\nM400\nM115\n", b"area:")
        code, output = ended(process)
    assert code == 0
    assert output.startswith("2 moves in ")
    assert "1 coordinates out of limits, 1 unknown commands" in output
    assert not link.is_symlink()


def test_a_termination_request_ends_it_too_and_a_socket_reaches_it(tmp_path: Path) -> None:
    with running("--tcp", "0", "--speed", "0", "--machine", "three_axis", "--habits", "no-advanced-ok") as (path, process):
        assert path.startswith("socket://localhost:")
        assert b"AXIS_COUNT:3" in talk(path, b"M115\n", b"Cap:")
        assert ended(process, signal.SIGTERM)[0] == 0


def test_faults_of_a_file_happen(tmp_path: Path) -> None:
    (tmp_path / "faults.toml").write_text('[[fault]]\nkind = "thermal runaway"\nline = 2\n')
    with (
        running("--faults", str(tmp_path / "faults.toml")) as (path, process),
        serial.Serial(path, timeout=PATIENCE_S) as host,
    ):
        host.write(b"G21\nG21\n")
        assert b"Error:Thermal Runaway" in host.read_until(b"//action:poweroff")
        process.kill()


@pytest.mark.parametrize(("options", "words"), [
    (["--speed", "-1"], "--speed is -1: it must be 0 (as fast as possible) or a number above"),
    (["--speed", "inf"], "--speed is inf"),
    (["--baud", "3"], "baud rate 3 is not possible: 1200 to 4000000 is allowed"),
    (["--tcp", "99999"], "--tcp is 99999: 0 (a free port) to 65535"),
    (["--pty", "x", "--tcp", "0"], "one of them is allowed"),
    (["--pty", "/nodir/x"], "the link /nodir/x cannot be made: no such file or directory"),
    (["--faults", "none.toml"], "the fault script none.toml cannot be read: no such file"),
    (["--ball", "20,0,45"], "--ball is 20,0,45: four numbers X,Y,Z,D in mm are allowed"),
    (["--ball", "20,0,45,0"], "a diameter above 0"),
    (["--habits", "melt"], "--habits holds 'melt': advanced-ok, emergency-parser,"),
    (["--machine", "linuxcnc_xyzac"], "takes no lines: marlin, reprapfirmware, klipper"),
])  # fmt: skip
def test_an_impossible_option_is_refused_with_a_one_line_error(
    options: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["simulator", *options]) == 1
    errors = capsys.readouterr().err
    assert words in errors
    assert errors.count("\n") == 1


def test_a_ball_on_its_plate_is_probed() -> None:
    with running("--machine", "gen5x", "--ball", "20,0,45,20", "--speed", "0") as (path, _):
        answer = talk(path, b"G28\nG90\nG1 X20 Y0 Z70 F6000\nG38.3 Z50\nM114\n", b"Bed comp")
    assert b" Z:55.0" in answer or b" Z:54.9" in answer


def test_a_file_at_the_link_s_path_is_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine").write_text("x")
    (tmp_path / "link").symlink_to(tmp_path / "mine")
    for name in ("mine", "link"):
        assert main(["simulator", "--pty", str(tmp_path / name)]) == 1
        assert "is not a link to a terminal" in capsys.readouterr().err
    assert (tmp_path / "link").read_text() == "x"


def test_build_options_are_parsed_from_words() -> None:
    assert read_build_options("", BuildOptions()) == BuildOptions()
    assert read_build_options("no-advanced-ok, realtime,rx-ring=64", BuildOptions()) == BuildOptions(
        advanced_ok=False, realtime=True, rx_ring=64
    )
    assert read_build_options("queue=16", BuildOptions()).queue == 16
    for bad in ("rx-ring=3", "rx-ring", "busy=1", "queue=0", "no-queue"):
        with pytest.raises(PrinterError, match=f"--habits holds '{bad}'"):
            read_build_options(bad, BuildOptions())
