"""Prints of the workbench: they end safely whichever process dies, and are refused as `print` refuses them."""

import asyncio
import os
import re
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import nullcontext
from functools import cache
from io import BytesIO
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from machine.link.journal import Journal, JournalHeading
from machine.link.pending_commands import Command, Control
from machine.link.print_state import PrintState, PrintStatus
from machine.notices import FrontEnd, Notice, notices_to, say
from machine.printing.checks import check
from machine.printing.destination import parse_destination
from machine.printing.history import past_prints
from machine.printing.job import Does, End, PrintJob, Scene
from machine.printing.serial_log import SerialLog
from machine.printing.servers import follow
from machine.printing.servers.http import VARIABLE
from machine.simulator.simulator import SimulatedPrinter
from machine.workbench.printing import running_print
from machine.workbench.printing.at_page import BEGIN, LEAVE, AtPage, JobState, Slices
from machine.workbench.printing.commands import COMMANDS, PageOfPrints, obey
from machine.workbench.printing.prints import Prints, past_row
from machine.workbench.printing.process import carry_out
from machine.workbench.printing.running_print import RunningPrint
from mdp.kernels.workers import frame, listen
from profiles.errors import PlanError, PrinterError, UserError
from profiles.messages import terminal_words
from profiles.profile import Profile, load
from tests.machine.link.failing_disk import keep_notes_in
from tests.machine.printing.servers.stand_ins import KEY, OctoPrintStandIn, stand_in

PROFILE = load()
_folder = tempfile.TemporaryDirectory()
HEAT = ["G21", "G90", "M83", "G28", "G92 A0 C0", "M140 S60", "M104 S210", "M109 S210", "G0 Z0.2 F600"]
STROKES = [f"G1 X{x} Y{y} E1.0 F60" for y in range(50) for x in (20, -20)]  # for an hour
HOUR = "\n".join([*HEAT, *STROKES, "M104 S0", "M140 S0"]) + "\n"


def order(
    port: str, gcode: str = HOUR, force: bool = True, profile: Profile = PROFILE, file: Path | None = None, starts: bool = True
) -> PrintJob:
    load = Slices("hour", file or written(gcode), profile)
    return PrintJob(parse_destination(port), Does.PRINT, "hour", load, profile, starts, force)


def rest_of(journal: Path, port: str) -> PrintJob:
    return PrintJob(parse_destination(port), Does.RESUME, cut_off=journal)


@cache
def written(gcode: str) -> Path:
    """A file with G-code, which exists while the tests run."""
    file = Path(_folder.name) / f"{len(gcode)}.gcode"
    file.write_text(gcode)
    return file


def print_until(port: str, runs: Callable[[RunningPrint], object], end: Callable[[Prints, RunningPrint], None]) -> JobState:
    """The last state of a print that is ended in a given way once a condition holds."""

    async def run() -> JobState:
        prints = Prints()

        async def reach(condition: Callable[[RunningPrint], object]) -> RunningPrint:
            while not condition(prints.prints[0]):
                await prints.changed(prints.version)
            return prints.prints[0]

        prints.begin("me", order(port))
        begun = await reach(lambda current: current.state.state == "ready")
        begun.begin()
        await reach(lambda current: current.state.live and runs(current))
        end(prints, begun)
        state = (await reach(lambda current: current.over)).state
        await asyncio.gather(*prints._tasks)
        return state

    return asyncio.run(asyncio.wait_for(run(), 60.0))


def heats(current: RunningPrint) -> bool:
    return current.state.status.temperature.nozzle_target_c == 210.0


def process_of(current: RunningPrint) -> "subprocess.Popen[bytes]":
    assert current._process is not None
    return current._process.process


def kill(prints: Prints, current: RunningPrint) -> None:
    os.kill(process_of(current).pid, signal.SIGKILL)


def hang_up(prints: Prints, current: RunningPrint) -> None:
    pipe = process_of(current).stdin
    assert pipe is not None
    pipe.close()


def break_off(prints: Prints, current: RunningPrint) -> None:
    """The server dies in the middle of a frame."""
    pipe = process_of(current).stdin
    assert pipe is not None
    pipe.write(frame((Command.PAUSE,))[:-1])
    pipe.close()


def cannot_be_told(prints: Prints, current: RunningPrint) -> None:
    """A bug in the program while it handles a report of the process."""
    tell = current._changed

    def fail() -> None:
        current._changed = tell
        raise ValueError("a state that nobody understands")

    current._changed = fail


def freeze(prints: Prints, current: RunningPrint) -> None:
    """Stop the print's process, so that it also ignores commands; then the user presses the emergency stop."""
    os.kill(process_of(current).pid, signal.SIGSTOP)
    prints.stop_at_once(None)


DIED = "the process that printed has ended before the print was done"
CANCELLED = r"the print was cancelled after \d+ lines; heaters off"


@pytest.mark.parametrize(("end", "expected"), [
    (kill, f"{DIED}; the printer reports its heaters off"),
    (freeze, f"{DIED}; emergency stop: the printer has halted"),
    (hang_up, CANCELLED),
    (break_off, CANCELLED),
    (cannot_be_told, f"a bug in tiltprint: .*; {DIED}; the printer reports its heaters off"),
])  # fmt: skip
def test_the_heaters_are_switched_off_whichever_process_dies(
    end: Callable[[Prints, RunningPrint], None], expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(running_print, "EMERGENCY_S", 0.2)
    with SimulatedPrinter(PROFILE.machine, speed=100.0) as printer:
        state = print_until(printer.path, heats, end)
        assert (printer.record.nozzle_target_c, printer.record.bed_target_c) == (0.0, 0.0)
    assert re.fullmatch(expected, state.sentence)
    assert Path(state.journal).is_file()
    (last, *_) = past_prints()
    assert (last["name"], last["outcome"]) == ("hour", "cancelled" if expected == CANCELLED else "failed")


GOES_ON = "is printing hour.gcode and continues without this program: control it on the server's page"


@pytest.mark.parametrize(("end", "expected"), [
    (kill, f"{DIED}; {{address}} {GOES_ON}"),
    (hang_up, "hour keeps printing on {address}: this page no longer follows it"),
])  # fmt: skip
def test_a_print_server_continues_whichever_process_dies_and_its_key_is_never_shown(
    end: Callable[[Prints, RunningPrint], None], expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, KEY)
    with stand_in("octoprint") as (job, address):
        job.steps = 10_000

        def has_begun(current: RunningPrint) -> bool:  # the page says "printing" while it still asks the server to begin
            return job.state == current.state.state == "printing" and current.state.live

        ended = print_until(address, has_begun, end)
        assert job.state == "printing"
    assert ended.sentence == expected.format(address=address)
    assert job.files["hour.gcode"].decode() == HOUR
    assert KEY not in f"{ended}{Path(ended.log).read_text()}"


def test_an_emergency_stop_while_the_file_is_handed_over_halts_the_printer_and_starts_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv(VARIABLE, KEY)
    uploading = threading.Event()

    class Slow(OctoPrintStandIn):
        def form(self, body: bytes) -> dict[str, tuple[str, bytes]]:
            uploading.wait(10.0)
            return super().form(body)

    async def run(address: str) -> JobState:
        prints = Prints()
        current = RunningPrint(1, order(address), "me", prints.notify)
        printing = asyncio.create_task(current.run())

        async def reach(phase: str) -> None:
            while current.state.state != phase:
                await prints.changed(prints.version)

        await reach("ready")
        current.begin()
        await reach("uploading")
        current.stop_at_once()
        await printing
        uploading.set()
        return current.state

    with stand_in("octoprint", handler=Slow) as (job, address):
        ended = asyncio.run(asyncio.wait_for(run(address), 60.0))
        assert (job.state, job.commands) == ("idle", ["M112"])
    assert ended.sentence == f"emergency stop: {address} has taken it; restart the printer before the next print"


# A print's process that is left and ignores everything it receives.
LEAVES = """
import sys, time
from machine.link.print_state import PrintState, PrintStatus
from machine.workbench.printing.at_page import JobState
from mdp.kernels.workers import frame, read_frames
for state in (PrintState.PRINTING, PrintState.LEFT):
    told = JobState(PrintStatus(state), True, time.time(), "hour", server=True, sentence="it goes on")
    sys.stdout.buffer.write(frame(told))
    sys.stdout.flush()
    for _ in zip(range(2 if state == WAITS_FOR else 0), read_frames(sys.stdin.buffer)):
        pass
"""


@pytest.mark.parametrize("waits_for", ["printing", "left"])
@pytest.mark.parametrize(("kind", "give", "expected", "halted", "state"), [
    ("octoprint", RunningPrint.stop_at_once, "emergency stop: {0} has taken it; ", True, "printing"),
    ("duet", RunningPrint.cancel, "the print was cancelled on {0}", False, "cancelled"),
])  # fmt: skip
def test_a_stop_or_cancel_of_a_print_being_left_uses_its_own_connection(
    waits_for: str,
    kind: str,
    give: Callable[[RunningPrint], None],
    expected: str,
    halted: bool,
    state: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv(VARIABLE, KEY)
    monkeypatch.setattr(running_print, "MAIN", f"WAITS_FOR = {waits_for.replace('left', '')!r}\n{LEAVES}")

    async def run(address: str) -> JobState:
        prints = Prints()
        current = RunningPrint(1, order(address), "me", prints.notify)
        current._begun = True
        printing = asyncio.create_task(current.run())
        while current.state.state != waits_for:
            await prints.changed(prints.version)
        give(current)
        await printing
        while not current.over:
            await prints.changed(prints.version)
        return current.state

    with stand_in(kind) as (job, address):
        job.files["hour.gcode"] = HOUR.encode()
        job.start("hour.gcode")
        job.steps = 10_000
        ended = asyncio.run(asyncio.wait_for(run(address), 60.0))
        assert (job.halted, job.state) == (halted, state)
    assert ended.sentence.startswith(expected.format(address))


class Heard:
    """Records the values reported."""

    def __init__(self) -> None:
        self.state: dict[str, Any] = {}

    def tell(self, **values: Any) -> None:
        self.state |= values


@pytest.mark.parametrize(("wanted", "sentence", "forcible"), [
    (order("/dev/no-such-port"), "port /dev/no-such-port does not exist", False),
    (rest_of(Path("gone.journal"), "/dev/none"), "journal gone.journal cannot be read: no such file", False),
    (rest_of(Path("any.journal"), "sim"), "--port sim: a simulated printer ends with its print", False),
    (PrintJob(parse_destination("duet:127.0.0.1:9"), Does.FOLLOW), "duet:127.0.0.1:9: nothing listens on 127.0.0.1", False),
    (order("octoprint:127.0.0.1:9"), "octoprint:127.0.0.1:9: nothing listens on 127.0.0.1 at port 9: is OctoPrint", False),
    (order("sim", "G28\nG1 X500 F600\n", force=False), "the dry run found 1 error, the first: X goes to 500 mm", True),
    (order("sim", file=Path("gone.gcode")), "these slices no longer exist: slice what is to be printed", False),
])  # fmt: skip
def test_a_job_that_print_refuses_is_refused_with_the_same_sentence(wanted: PrintJob, sentence: str, forcible: bool) -> None:
    heard = Heard()
    end, goes_on = carry_out(wanted, AtPage(heard))  # type: ignore[arg-type]
    assert terminal_words(end.sentence).startswith(sentence)
    assert (end.state, goes_on) == ("refused", forcible)
    assert "state" not in heard.state  # no server was queried


def test_an_incomplete_journal_is_refused_at_the_page_with_the_sentence_of_resume(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    keep_notes_in(tmp_path / "notes", monkeypatch)
    with Journal(tmp_path / "j", JournalHeading("p.gcode", "", "p", {})) as journal:
        journal.path.rename(tmp_path / "moved")
    end, _ = carry_out(rest_of(tmp_path / "moved", "/dev/none"), AtPage(Heard()))  # type: ignore[arg-type]
    assert end.state == "refused"
    assert end.sentence.startswith(
        f"journal {tmp_path / 'moved'} is incomplete: its print continued after the journal could no longer"
    )


def test_the_page_reports_at_once_that_a_print_can_no_longer_be_resumed(tmp_path: Path) -> None:
    heard, log = Heard(), SerialLog(tmp_path / "log", "p")
    person = AtPage(heard)  # type: ignore[arg-type]
    with (
        log,
        Journal(tmp_path / "j", JournalHeading("p.gcode", "", "p", {})) as journal,
        person.show(Scene("p", log, journal)) as show,
    ):
        show(None)
        show(PrintStatus(elapsed_s=1.0))
        assert (heard.state["journal"], heard.state["status"].warning) == (str(tmp_path / "j"), "")
        show(PrintStatus(elapsed_s=2.0, warning="this print can no longer be resumed"))
    assert (heard.state["journal"], heard.state["status"].warning) == ("", "this print can no longer be resumed")


def test_an_upload_is_not_a_print_and_other_server_messages_do_not_end_one(tmp_path: Path) -> None:
    heard, log = Heard(), SerialLog(tmp_path / "log", "p")
    person, told = AtPage(heard), list[tuple[str, bool, str]]()  # type: ignore[arg-type]
    moments = [(True, PrintState.UPLOADING), (False, PrintState.PAUSED), (False, PrintState.READY), (False, PrintState.DONE)]
    with log:
        for uploads, scene_moments in groupby(moments, key=itemgetter(0)):
            with person.show(Scene("p", log, server="s", uploads=uploads)) as show:
                for _, state in scene_moments:
                    show(PrintStatus(state, message=f"it is {state}"))
                    status = heard.state["status"]
                    told.append((status.state, heard.state["live"], status.message))
    assert told == [
        ("uploading", False, "it is uploading"),
        ("paused", True, "it is paused"),
        ("paused", True, "it is ready"),
        ("paused", True, "it is done"),
    ]


@pytest.mark.parametrize(("kind", "profile"), [("octoprint", PROFILE), ("duet", load("gen5x"))])
def test_a_file_can_be_uploaded_while_its_server_prints_another(
    kind: str, profile: Profile, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, KEY)
    heard = Heard()
    person = AtPage(heard)  # type: ignore[arg-type]
    person.hear(BEGIN)
    with stand_in(kind) as (job, address):
        job.files["vase.gcode"] = bytes(100)
        job.start("vase.gcode")
        job.steps = 10_000
        end, _ = carry_out(order(address, profile=profile, starts=False), person)
        assert (job.state, job.files["hour.gcode"].decode()) == ("printing", HOUR)
        assert not any(asked.endswith("/start") for asked in job.asked)
        log = Path(heard.state["log"]).read_text()
    assert (end.state, end.sentence) == ("done", f"hour.gcode waits on {address}")
    assert "hour.gcode" in log
    assert KEY not in log


class Attended:
    """A print on a server in its own thread, controlled by the user of a page."""

    def __init__(self, wanted: PrintJob) -> None:
        self.heard = Heard()
        self.person = AtPage(self.heard)  # type: ignore[arg-type]
        threading.Thread(target=lambda: self.heard.tell(end=carry_out(wanted, self.person)[0]), daemon=True).start()
        self.until(lambda state: "state" in state)
        self.person.hear(BEGIN)
        self.until(lambda state: state.get("status") and state["status"].state == "printing")

    def ended(self) -> End:
        """How it ended, once it has."""
        end: End = self.until(lambda state: state.get("end"))["end"]
        return end

    def until(self, condition: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
        end_s = time.monotonic() + 20.0
        while not condition(self.heard.state):
            assert time.monotonic() < end_s, f"that never came, only {self.heard.state}"
            time.sleep(0.01)
        return self.heard.state


def test_a_user_controls_a_print_on_a_duet_from_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, KEY)
    monkeypatch.setattr(follow, "POLL_S", 0.05)
    stopped = "emergency stop: {0} has taken it; restart the printer before the next print; nozzle 210 °C, bed 60 °C as last"
    left = "hour keeps printing on {0}: this page no longer follows it"
    with stand_in("duet") as (job, address):
        job.steps = 10_000
        wanted = order(address, profile=load("gen5x"))
        current = Attended(wanted)
        assert job.files["hour.gcode"].decode() == HOUR
        current.person.hear(Command.FEED, 150.0)
        current.person.hear(Command.PAUSE)
        current.until(lambda state: (state["status"].state, state["status"].feed_percent) == ("paused", 150.0))
        assert (job.state, job.commands) == ("paused", ["M220 S150"])
        current.person.hear(Command.RESUME)
        current.until(lambda state: state["status"].state == "printing")
        cancelled = "the print was cancelled on {0}"
        for word, sentence, state in ((Command.CANCEL, cancelled, "cancelled"), (LEAVE, left, "printing")):
            current.person.hear(word)
            assert current.ended().sentence.startswith(sentence.format(address))
            assert job.state == state
            job.state = "idle"
            current = Attended(wanted)
        current.until(lambda state: state["status"].temperature.nozzle_c)
        current.person.hear(Command.EMERGENCY_STOP)
        assert current.ended().sentence.startswith(stopped.format(address))
        assert job.halted
        assert current.person.has_stopped()


def test_a_print_whose_server_dies_at_any_byte_of_a_command_is_left() -> None:
    pause = frame((Command.PAUSE,))
    for sent in range(len(pause)):
        person = AtPage(Heard())  # type: ignore[arg-type]
        listen(BytesIO(pause[:sent]), lambda words, person=person: person.hear(*words), person.leave)  # type: ignore[misc]
        assert person.left()
        assert person.ask("") is None


def test_a_stop_after_the_end_of_a_print_reports_that_nothing_was_stopped() -> None:
    person = AtPage(Heard())  # type: ignore[arg-type]
    assert not person.has_stopped()
    person.hear(Command.EMERGENCY_STOP)
    assert not person.has_stopped()


def test_an_objection_overridden_by_force_is_shown_in_place_of_its_check() -> None:
    heard = Heard()
    person = AtPage(heard)  # type: ignore[arg-type]
    with notices_to(FrontEnd(person.hear_notice)):
        assert not check(["", "an axis is missing"], force=True)
        say("one moment")
        assert check([""], force=True)
        person.passed("the file is whole")
        with pytest.raises(PrinterError, match="too hot") as refused:
            check(["too hot"], force=False)
    assert refused.value.forcible
    assert heard.state["checks"] == (Notice("an axis is missing", forced=True), Notice("the file is whole"))
    assert heard.state["said"] == ("an axis is missing", "one moment")


def page_of(prints: Prints, name: str = "me") -> PageOfPrints:
    return PageOfPrints(name, SimpleNamespace(), prints, SimpleNamespace())  # type: ignore[arg-type]


def enter(current: RunningPrint, state: str) -> None:
    current.state = current.state.changed(PrintState(state))


def prints_with_one(port: str = "sim") -> Prints:
    prints = Prints()
    prints.prints.append(RunningPrint(1, order(port), "me", prints.notify))
    return prints


@pytest.mark.parametrize(("does", "most"), [("feed", 300), ("flow", 200)])
def test_a_speed_or_flow_out_of_range_is_refused_at_the_command(does: str, most: int) -> None:
    with pytest.raises(PlanError, match=rf"percent is 5000: it must be a whole number from 10 to {most}"):
        obey(page_of(prints_with_one()), {"do": does, "print": 1, "percent": 5000})


@pytest.mark.parametrize("percent", [float("inf"), float("nan"), "fast", True, 99.5, [1]])
def test_a_speed_that_is_no_number_is_refused(percent: object) -> None:
    with pytest.raises(PlanError, match=r"percent is .*: it must be a whole number"):
        obey(page_of(prints_with_one()), {"do": "feed", "print": 1, "percent": percent})


@pytest.mark.parametrize(("asked", "said"), [
    ({"do": "ports", "baud": None}, "baud is null: it must be a whole number"),
    ({"do": "check", "port": ["sim"]}, "port is .*: it must be a text"),
    ({"do": "hand", "port": "sim", "sim_speed": float("nan")}, "sim_speed is nan: it must be a number"),
    ({"do": "hand", "port": "sim", "sim_speed": float("inf")}, "sim_speed is inf: it must be a number"),
    ({"do": "by_hand", "print": 1, "does": "dance"}, "does is .dance."),
    ({"do": "by_hand", "print": 1, "does": "jog", "by_mm": 10**400}, "by_mm is 1000"),
    ({"do": "begin", "print": "1"}, "print is .1.: it must be a whole number"),
])  # fmt: skip
def test_an_argument_of_a_wrong_type_is_refused(asked: dict[str, Any], said: str) -> None:
    with pytest.raises(PlanError, match=said):
        obey(page_of(prints_with_one()), asked)


@pytest.mark.parametrize("number", [{}, {"print": None}, {"print": "all"}, {"print": {"number": 1}}, {"print": 7, "more": [1]}])
def test_an_emergency_stop_is_executed_whatever_else_a_page_sends(
    number: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    stopped: list[int] = []
    monkeypatch.setattr(RunningPrint, "stop_at_once", lambda current: stopped.append(current.number))
    obey(page_of(prints_with_one(), "other"), {"do": "emergency", **number})
    assert stopped == [1]


@pytest.mark.parametrize("by_mm", [float("inf"), float("nan"), "up", 2.5, None])
def test_a_z_offset_that_is_no_small_number_is_refused(by_mm: object) -> None:
    with pytest.raises(PlanError, match=r"by_mm is .*"):
        obey(page_of(prints_with_one()), {"do": "babystep", "print": 1, "by_mm": by_mm})


GIVEN = {"percent": 100, "does": "heat", "by_mm": 0.01}


@pytest.mark.parametrize(
    "name", sorted({*COMMANDS} - {"ports", "journals", "check", "go_on", "follow", "hand", "emergency", "take"})
)
def test_only_the_page_that_commands_a_print_may_say_anything_to_it_but_to_stop_at_once(name: str) -> None:
    prints = prints_with_one()
    with pytest.raises(PrinterError, match="another page controls this print"):
        obey(page_of(prints, "other"), {**GIVEN, "do": name, "print": 1})
    with pytest.raises(PrinterError, match="this print no longer exists"):
        obey(page_of(prints), {**GIVEN, "do": name, "print": 2})
    obey(page_of(prints, "other"), {"do": "take", "print": 1})
    assert prints.prints[0].holder == "other"


@pytest.mark.parametrize(("name", "port", "state", "allowed"), [
    ("leave", "sim", "printing", False), ("leave", "duet:printer", "printing", True),
    ("forget", "sim", "printing", False), ("forget", "sim", "done", True), ("dance", "sim", "printing", False),
    (["take"], "sim", "printing", False),
])  # fmt: skip
def test_a_command_that_a_print_cannot_execute_is_refused(name: Any, port: str, state: str, allowed: bool) -> None:
    prints = prints_with_one(port)
    enter(prints.prints[0], state)
    with (
        nullcontext()
        if allowed
        else pytest.raises(UserError, match=r"only (a print on a print server|one that is over)|no(t a)? command")
    ):
        obey(page_of(prints), {"do": name, "print": 1})
    assert bool(prints.prints) == (name != "forget" or not allowed)


def test_an_emergency_stop_overtakes_all_earlier_commands() -> None:
    control = Control()
    control.ask(Command.PAUSE)
    control.ask(Command.EMERGENCY_STOP)
    assert [asked.command for asked in iter(control.take, None)] == [Command.EMERGENCY_STOP, Command.PAUSE]


def test_a_print_requested_twice_begins_once(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[object] = []
    monkeypatch.setattr(RunningPrint, "say", lambda current, value: said.append(value))
    current = RunningPrint(1, order("sim"), "me", lambda: None)
    with pytest.raises(PrinterError, match="cannot begin now"):
        current.begin()
    enter(current, "ready")
    current.begin()
    current.begin()
    assert said == [(BEGIN,)]


def test_a_stop_that_is_pressed_twice_stops_no_other_print(monkeypatch: pytest.MonkeyPatch) -> None:
    stopped: list[int] = []
    monkeypatch.setattr(RunningPrint, "stop_at_once", lambda current: stopped.append(current.number))

    async def run() -> None:
        prints = Prints()
        prints.prints += [RunningPrint(number, order("sim"), "me", lambda: None) for number in (1, 2)]
        prints._last = 2
        enter(prints.prints[0], "failed")  # by the first press
        prints.stop_at_once(1)
        del prints.prints[0]  # another page has removed it from the list
        prints.stop_at_once(1)
        assert 2 not in stopped
        prints.stop_at_once(None)
        assert 2 in stopped

    asyncio.run(run())


def test_the_list_has_all_running_prints_and_the_newest_five_that_are_over(monkeypatch: pytest.MonkeyPatch) -> None:
    stopped: list[int] = []
    monkeypatch.setattr(RunningPrint, "stop_at_once", lambda current: stopped.append(current.number))

    async def runs(current: RunningPrint) -> None:
        """Return at once, without an end of the print."""

    async def run() -> None:
        prints = Prints()
        monkeypatch.setattr(RunningPrint, "run", runs)
        for number in range(1, 16):
            prints.begin("me", order(f"/dev/port{number}"))
            if number > 8:
                enter(prints.prints[-1], "done")
        prints.begin("me", order("/dev/port16"))
        prints.stop_at_once(None)
        assert stopped == [1, 2, 3, 4, 5, 6, 7, 8, 16]
        assert [listed.number for listed in prints.prints if listed.over] == [11, 12, 13, 14, 15]

    asyncio.run(run())


def test_a_past_print_is_shown_as_texts_with_dashes_for_unknown_values() -> None:
    done = {"name": "box", "outcome": "done", "begun": 7.0, "seconds": 5400.0, "filament_m": 1.25}
    assert past_row(done) == {"cells": ["box", "done", "1h 30m", "1.2 m"], "begun": 7.0}
    assert past_row({**done, "seconds": None, "filament_m": None})["cells"] == ["box", "done", "–", "–"]
