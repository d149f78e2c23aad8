"""`tiltprint send` and `print --port SERVER`: checks before anything is sent, messages, and remaining files."""

import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from machine.cli.cli import main
from machine.cli.terminal.at_terminal import AtTerminal
from machine.cli.terminal.keys import LEAVING
from machine.dryrun.dryrun import dry_run
from machine.link.pending_commands import CancelledError
from machine.pipeline.programs import LoadedProgram
from machine.printing.destination import parse_server_address
from machine.printing.job import PrintJob, Scene
from machine.printing.serial_log import SerialLog
from machine.printing.server_print import ServerPrinter, hand_over
from machine.printing.servers import follow
from machine.printing.servers.http import VARIABLE
from machine.printing.servers.octoprint import OctoPrint
from machine.printing.servers.server import GcodeUpload, Sent
from machine.program import Program
from profiles.errors import ServerError
from profiles.profile import load
from tests.machine.person import HASTY, ROOT, Person
from tests.machine.printing.servers.stand_ins import KEY, session_with, stand_in

PROGRAMS = Path(__file__).resolve().parents[2] / "programs"
MARLIN, KLIPPER = PROGRAMS / "post_and_arm_generic_ac.gcode", PROGRAMS / "post_and_arm_fractal5pro.gcode"


@pytest.fixture(autouse=True)
def _own_folders(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(follow, "POLL_S", 0.02)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv(VARIABLE, KEY)


def sent(*words: object) -> int:
    return main(["send", *map(str, words)])


def test_a_file_is_uploaded_and_started_on_request(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    with stand_in("octoprint") as (job, address):
        assert sent(MARLIN, "--to", address, "--force") == 0
        assert job.files["post_and_arm_generic_ac.gcode"].decode().splitlines() == MARLIN.read_text().splitlines()
        assert job.state == "idle"
        first = capsys.readouterr()
        assert sent(MARLIN, "--to", address, "--start", "--force") == 0
        assert job.state == "printing"
    second = capsys.readouterr()
    assert f"post_and_arm_generic_ac.gcode waits on {address}" in first.out
    assert f"post_and_arm_generic_ac.gcode prints on {address}" in second.out
    assert "replaces the post_and_arm_generic_ac.gcode that is there" in second.err
    left_behind = b"".join(file.read_bytes() for file in (tmp_path / "state").rglob("*") if file.is_file())
    assert b"GET /api/version" in left_behind
    assert KEY.encode() not in left_behind
    assert KEY not in first.out + first.err + second.out + second.err


@pytest.mark.parametrize(("kind", "file"), [("octoprint", MARLIN), ("moonraker", KLIPPER)])
def test_a_print_on_a_server_is_followed_to_its_end(kind: str, file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with stand_in(kind, steppers=("stepper_a", "stepper_c")) as (job, address):
        assert main(["print", str(file), "--port", address, "--force", "--watch", "--no-browser"]) == 0
    said = capsys.readouterr()
    assert "there is no journal to resume from after a power cut" in said.err
    assert f"printed {file.name} on {address}" in said.out
    assert "watch the print at http" in said.err
    assert job.state == "complete"


@pytest.mark.parametrize("kind", ["octoprint", "moonraker", "duet"])
def test_a_print_that_a_server_is_at_already_is_followed_to_its_end(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    with stand_in(kind) as (job, address):
        assert main(["follow", address]) == 1
        assert f"{address} prints nothing now (ready): there is nothing to follow" in capsys.readouterr().err.replace("\n", " ")
        job.files["vase.gcode"] = bytes(100)
        job.start("vase.gcode")
        assert main(["follow", address]) == 0
    output = capsys.readouterr()
    file = "its file" if kind == "duet" else "vase.gcode"  # a Duet does not report a file name with its state
    assert f"it is printing {file}" in output.err
    assert output.out.startswith(f"printed {file} on {address} in ")
    assert not any(asked.endswith(("upload", "/start")) for asked in job.asked)


NO_MACRO = "which this Klipper does not know"
STEPPERS = ("stepper_a", "stepper_b")


@pytest.mark.parametrize(("kind", "more", "words", "sentence"), [
    ("moonraker", {}, (MARLIN, "--force"),
     "generic A/C table writes for marlin, but Moonraker prints klipper or klipper_steppers: "),
    ("duet", {}, (KLIPPER, "--force"),
     "Fractal 5 Pro writes for klipper, but a Duet prints reprapfirmware: --machine must be one of those, as gen5x"),
    ("moonraker", {"steppers": ("stepper_b",)}, (KLIPPER,), "which this Klipper lacks; it has stepper_b"),
    ("moonraker", {"steppers": STEPPERS, "macros": ()}, (KLIPPER,),
     f"Pro calls HOME_AB, {NO_MACRO} and would pass over: it needs [gcode_macro HOME_AB]"),
    ("moonraker", {"steppers": STEPPERS}, ("own.gcode",), f"own.gcode calls CHAMBER_HEAT, {NO_MACRO}"),
    ("octoprint", {}, (MARLIN,), "the dry run found 1 error, the first: the part begins in air"),
    ("octoprint", {}, (MARLIN, "--set", "machine.tilt.point_mm=[0, 0, -33]"),
     "was made when machine.tilt.point_mm of generic A/C table was"),
])  # fmt: skip
def test_an_unsuitable_file_is_refused_before_any_byte_is_sent(
    kind: str,
    more: dict[str, Any],
    words: tuple[object, ...],
    sentence: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    own = KLIPPER.read_text().replace("\nM190", "\nchamber_heat S=40 ; of the file's own\nM190", 1)
    (tmp_path / "own.gcode").write_text(own)
    monkeypatch.chdir(tmp_path)
    with stand_in(kind, **more) as (job, address):
        assert sent(*words, "--to", address) == 1
    assert sentence in " ".join(capsys.readouterr().err.split())
    assert not any(asked.startswith("POST") and "query" not in asked for asked in job.asked)
    assert job.files == {}


def test_a_busy_server_is_reported_before_any_work(capsys: pytest.CaptureFixture[str]) -> None:
    with stand_in("octoprint") as (job, address):
        job.files["other.gcode"] = b"G28\n" * 100_000
        job.start("other.gcode")
        assert sent(MARLIN, "--to", address, "--start") == 1
    assert f"{address} is printing other.gcode now: wait until that is done" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["send", "box.stl", "--to", "octoprint:octopi"], "box.stl is not a G-code file: export makes one"),
        (["send", str(MARLIN), "--to", "prusalink:host"], "octoprint:HOST, moonraker:HOST or duet:HOST"),
        (
            ["print", str(MARLIN), "--port", "octoprint:octopi", "--journal", "j"],
            "--journal j: octoprint:octopi prints from a file",
        ),
        (["send", str(MARLIN), "--to", "octoprint:octopi", "--log", str(MARLIN)], "is the same file as the model, which is read"),
    ],
)
def test_a_file_that_cannot_be_sent_gives_a_one_line_error(
    words: list[str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words) == 1
    said = capsys.readouterr().err
    assert sentence in said
    assert said.count("\n") == 1


def test_an_interrupted_upload_is_reported(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def interrupted(*_: object) -> str:
        raise KeyboardInterrupt

    monkeypatch.setattr(OctoPrint, "upload", interrupted)
    with stand_in("octoprint") as (_, address):
        assert sent(MARLIN, "--to", address, "--force") == 130
    assert f"upload broken off: {address} keeps nothing of post_and_arm_generic_ac.gcode" in capsys.readouterr().err


def print_of(address: str) -> list[str]:
    return ["print", str(MARLIN), "--port", address, "--force"]


@pytest.mark.slow
def test_a_print_on_a_server_is_paused_by_a_key_and_cancelled_by_the_second_ctrl_c() -> None:
    with stand_in("octoprint") as (job, address):
        job.steps = 10_000
        with Person(*print_of(address)) as person:
            before = person.settings()
            person.see("so far")
            person.press("p")
            person.see("paused")
            assert job.state == "paused"
            person.press("r")
            person.see("printing")
            person.press("\x03")
            person.see(LEAVING[:40])
            assert job.state == "printing"
            person.press("\x03")
            person.see(f"tiltprint: the print was cancelled on {address}")
            assert person.settings() == before
            assert person.end() == 130
    assert job.state == "cancelled"


@pytest.mark.slow
@pytest.mark.parametrize(("interrupts", "state"), [(1, "printing"), (2, "cancelled")])
def test_without_a_terminal_one_interrupt_detaches_and_two_cancel(interrupts: int, state: str) -> None:
    with stand_in("octoprint") as (job, address):
        job.steps = 10_000
        command = [sys.executable, "-c", HASTY, *print_of(address)]
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, cwd=ROOT)
        assert process.stderr is not None
        for words in (b"printing: ", b"the print continues at")[:interrupts]:
            next(line for line in process.stderr if line.startswith(words))
            process.send_signal(signal.SIGINT)
        process.communicate()
        assert process.returncode == 130
        assert job.state == state


@pytest.mark.slow
def test_the_emergency_key_halts_the_printer_behind_a_server() -> None:
    with stand_in("octoprint") as (job, address):
        job.steps = 10_000
        with Person(*print_of(address)) as person:
            person.see("so far")
            person.press("ee")
            person.see(f"tiltprint: emergency stop: {address} has taken it; restart the printer before the next print")
            assert person.end() == 1
    assert job.commands == ["M112"]


@pytest.mark.parametrize("command", [["console"], ["resume", "print.journal"]])
def test_a_server_is_no_port_for_what_talks_to_the_printer_itself(command: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*command, "--port", "moonraker:host"]) == 1
    assert "--port moonraker:host is a print server, which takes whole files by print and send" in capsys.readouterr().err


def scene(folder: Path) -> Scene:
    return Scene("a.gcode to octoprint:host", SerialLog(folder / "log", "a.gcode"), server="octoprint:host")


@pytest.mark.parametrize(("gone", "rest"), [(0, "keeps nothing of"), (7, "may hold all of")])
def test_an_aborted_upload_reports_what_the_server_kept(
    gone: int, rest: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    class Interrupted:
        name = "octoprint:host"

        def has(self, file: str) -> bool:
            return False

        def upload(self, upload: GcodeUpload, sent: Sent) -> str:
            sent(gone)
            raise KeyboardInterrupt

    server: object = Interrupted()
    with pytest.raises(KeyboardInterrupt):
        hand_over(server, GcodeUpload("a.gcode", ("G1 X10",)), "a.gcode", scene(tmp_path), AtTerminal())  # type: ignore[arg-type]
    assert f"upload broken off: octoprint:host {rest} a.gcode" in capsys.readouterr().err


def test_cancelling_at_the_terminal_aborts_the_upload(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    class GivingUp(AtTerminal):
        def cancels(self) -> bool:
            return True

    with stand_in("octoprint") as (job, address), session_with(address) as server:
        with pytest.raises(CancelledError):
            hand_over(server, GcodeUpload("a.gcode", ("G1 X10",)), "a.gcode", scene(tmp_path), GivingUp())
        assert job.files == {}
    assert f"upload broken off: {address} keeps nothing of a.gcode" in capsys.readouterr().err


def test_a_server_that_another_has_given_a_print_meanwhile_is_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    profile, lines = load(), ("G28", "G1 X10 F600")
    loaded = LoadedProgram("a.gcode", Program(lines, dry_run(lines, profile), None), profile)
    with stand_in("moonraker") as (job, address), session_with(address) as server:
        server.greet()
        hold = server.upload

        def upload(program: GcodeUpload, sent: Sent) -> str:
            job.files["other.gcode"] = b"G28\n"
            job.start("other.gcode")
            return hold(program, sent)

        monkeypatch.setattr(server, "upload", upload)
        order = PrintJob(parse_server_address(address))
        printer = ServerPrinter(order, server, SerialLog(tmp_path / "log", "a.gcode"), AtTerminal())
        with pytest.raises(ServerError, match=r"is printing other\.gcode now: wait until that is done"):
            printer.print(loaded)
        assert "POST /printer/print/start" not in job.asked
