"""Print jobs of slices whose findings are known: they are refused before a printer is queried, or begin sooner."""

import asyncio
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from zlib import crc32

import pytest

from machine.dryrun.dryrun import dry_run, summary
from machine.dryrun.findings import Finding, KnownFindings, known_findings
from machine.link.print_state import PrintState, PrintStatus
from machine.notices import Notice
from machine.printing.destination import Destination, SerialPort, Simulated, parse_destination, parse_server_address
from machine.printing.job import Does, PrintJob
from machine.program import Alternative
from machine.workbench.printing.at_page import AtPage, JobState, Slices
from machine.workbench.printing.commands import job_of
from machine.workbench.printing.prints import FILE, Prints, keep_printer, last_printer
from machine.workbench.printing.process import carry_out
from machine.workbench.work.slices import Sliced
from profiles.errors import PlanError, PrinterError, UserError
from profiles.folders import state_folder
from profiles.messages import terminal_words
from profiles.profile import Profile, load

PROFILE = load()
HEAT = ["G21", "G90", "M83", "G28", "G92 A0 C0", "M104 S210", "M109 S210"]
GOOD, BAD = [*HEAT, "G1 X10 E1 F600", "M104 S0"], ["G28", "G1 X500 F600"]
OTHER = Finding("warning", "told", 1, 0, 0, "was found before")


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def file(lines: list[str]) -> Path:
    """A G-code file of these lines."""
    content = ("\n".join(lines) + "\n").encode()
    path = Path(f"{crc32(content)}.gcode")
    path.write_bytes(content)
    return path


def session(lines: list[str], profile: Profile = PROFILE) -> Any:
    """A bench with slices of these lines, dry-run as slicing does it."""
    known = known_findings(lines, profile, dry_run(lines, profile).findings)
    sliced = Sliced(
        Path("page.html"), file(lines), "key", 60.0, 1.0, known, Alternative("in 1 part", "", 1, 60.0, 1.0, 1.0, 0.0, 0.0)
    )
    bench = SimpleNamespace(model=SimpleNamespace(name="box.stl"), profile=profile)
    return SimpleNamespace(
        closed=False, bench=bench, slicing=SimpleNamespace(needed=lambda: SimpleNamespace(bench=bench, sliced=sliced))
    )


class Silent:
    """A reporter without output."""

    def tell(self, **values: Any) -> None:
        """Discard the values."""


def refusal(given: Any, port: str, **further: Any) -> UserError:
    with pytest.raises(UserError) as refused:
        asyncio.run(job_of(given, parse_destination(port, **further), False))
    return refused.value


def test_errors_known_from_slicing_are_refused_before_the_printer_is_contacted() -> None:
    sentence = str(refusal(session(BAD), "/dev/no-such-port"))
    silent: Any = Silent()
    load = Slices("box.stl", file(BAD), PROFILE)
    by_print, _ = carry_out(PrintJob(parse_destination("sim"), Does.PRINT, "box.stl", load, PROFILE), AtPage(silent))
    assert (sentence, by_print.state) == (terminal_words(by_print.sentence), "refused")
    assert sentence.startswith("the dry run found ")
    assert "X goes to 500 mm" in sentence
    assert asyncio.run(job_of(session(BAD), parse_destination("/dev/no-such-port"), True)).force


@pytest.mark.parametrize(("machine", "port", "further", "sentence"), [
    ("linuxcnc_xyzac", "/dev/no-such-port", {}, "speaks linuxcnc, which opens files itself: use export"),
    ("generic_ac", "duet:printer", {}, "generic A/C table writes for marlin, but a Duet prints reprapfirmware: "),
    ("generic_ac", "/dev/no-such-port", {"baud": 7}, "baud rate 7 is not possible: "),
    ("generic_ac", "sim", {"speed": -1.0}, "--sim-speed is -1: "),
])  # fmt: skip
def test_conflicts_of_machine_and_port_are_refused_first(machine: str, port: str, further: dict[str, Any], sentence: str) -> None:
    refused = refusal(session(BAD, load(machine)), port, **further)
    assert isinstance(refused, PrinterError)
    assert sentence in str(refused)


def test_stale_slices_are_refused_before_all_else() -> None:
    def needed() -> Sliced:
        raise PlanError("slice it again")

    stale = session(BAD)
    stale.slicing = SimpleNamespace(needed=needed)
    assert str(refusal(stale, "/dev/no-such-port")) == "slice it again"


def program(lines: list[str], profile: Profile, known: KnownFindings | None) -> tuple[Finding, ...]:
    return Slices("box.stl", file(lines), profile, known)().program.run.findings


def test_findings_of_the_same_lines_and_profile_are_not_computed_again() -> None:
    known = known_findings(GOOD, PROFILE, [OTHER])
    assert program(GOOD, PROFILE, known) == (OTHER,)
    slices = Slices("box.stl", file(GOOD), PROFILE, known)
    anew = dry_run(GOOD, PROFILE)
    looked_for = {"findings": [], "interfaces": []}
    assert summary(slices().program.run) | looked_for == summary(anew) | looked_for


@pytest.mark.parametrize(("lines", "profile"), [
    ([*GOOD[:-1], "M104 S1"], PROFILE),
    ([*GOOD, ""], PROFILE),
    (GOOD[1:], PROFILE),
    (GOOD, load(settings=["machine.nozzle_limit_c=290"])),
])  # fmt: skip
def test_a_difference_of_a_byte_or_a_setting_causes_another_dry_run(lines: list[str], profile: Profile) -> None:
    findings = program(lines, profile, known_findings(GOOD, PROFILE, [OTHER]))
    assert findings == dry_run(lines, profile).findings
    assert OTHER not in findings


def test_a_line_that_would_be_read_again_as_two_causes_another_dry_run() -> None:
    in_one = [*GOOD[:-2], "\n".join(GOOD[-2:])]
    assert file(in_one) == file(GOOD)
    assert OTHER not in program(GOOD, PROFILE, known_findings(in_one, PROFILE, [OTHER]))


@pytest.fixture(autouse=True)
def _own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))


@pytest.mark.parametrize("at", [SerialPort("/dev/ttyACM0", 250000), Simulated(2.0), parse_server_address("duet:printer")])
def test_the_printer_of_last_time_is_known_at_the_next_start(at: Destination) -> None:
    assert last_printer() is None
    assert Prints().snapshot()["last_printer"] is None
    keep_printer(at)
    assert last_printer() == at
    assert Prints().snapshot()["last_printer"]["port"] == at.name
    assert Prints().ports_known == {at.name}


@pytest.mark.parametrize("text", [
    "", "{", "[]", "{}", "null", '{"port": "sim"}', '{"port": "sim", "baud": "fast", "sim_speed": 1}',
    '{"port": 1, "baud": "x", "sim_speed": 0}', '{"port": "/dev/ttyS0", "baud": 7, "sim_speed": 0}',
    '{"port": "/dev/ttyS0", "baud": Infinity, "sim_speed": 0}',
])  # fmt: skip
def test_a_stored_destination_without_a_printer_is_ignored(text: str) -> None:
    (state_folder() / FILE).write_text(text)
    assert last_printer() is None


@pytest.mark.parametrize("end", [PrintState.CANCELLED, PrintState.FAILED, PrintState.DONE])
def test_a_print_that_is_over_keeps_its_last_moment_in_the_state_in_which_it_ended(end: PrintState) -> None:
    printing = JobState(PrintStatus(PrintState.PRINTING, layer=7), live=True).json()
    assert (printing["state"], printing["is_printing"], printing["is_over"]) == ("printing", True, False)
    ended = JobState(PrintStatus(PrintState.PRINTING, layer=7), live=True).changed(end, sentence="over").json()
    assert (ended["state"], ended["is_printing"], ended["is_over"], ended["layer"], ended["sentence"]) == (
        end,
        False,
        True,
        7,
        "over",
    )


def test_a_warning_is_shown_beside_the_state_and_read_aloud() -> None:
    lost = "this print can no longer be resumed"
    told = JobState(PrintStatus(PrintState.PRINTING, share=0.5, warning=lost), live=True, name="box").json()
    assert told["how"] == f"printing, 50 % · {lost}"
    assert told["texts"]["run-news"] == f"box: printing: {lost}"


def test_progress_before_a_print_is_shown_only_while_it_lasts() -> None:
    told: list[tuple[str, ...]] = []
    person = AtPage(SimpleNamespace(tell=lambda said: told.append(said)))
    person.hear_notice(Notice("the printer answers\n"))
    with person.progress() as report:
        report("getting ready: 0 steps are done")
    assert told == [
        ("the printer answers",),
        ("the printer answers", "getting ready: 0 steps are done"),
        ("the printer answers",),
    ]
