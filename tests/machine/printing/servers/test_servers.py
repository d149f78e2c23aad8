"""Each kind of server: a file uploaded, printed, paused, cancelled, stopped; refusals and lost connections as sentences."""

import contextlib
import random
import re
import shutil
import socket
import subprocess
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from machine.firmware import dialect_of
from machine.link.pending_commands import Command, Control
from machine.link.print_state import PrintState, PrintStatus
from machine.printing.destination import parse_server_address
from machine.printing.rescue import cancel_on_server, rescue
from machine.printing.servers import duet, follow, http
from machine.printing.servers.follow import Follower
from machine.printing.servers.http import VARIABLE, servers_file
from machine.printing.servers.server import GcodeUpload, PrintServer
from machine.printing.servers.servers import KINDS
from profiles.errors import NoAnswerError, ServerError
from profiles.profile import load
from tests.machine.printing.servers.stand_ins import KEY, STAND_INS, Job, session_with, stand_in

LINES = tuple(f"G1 X{k}" for k in range(20_000))
UPLOAD = GcodeUpload("box.gcode", LINES)
STATUS = ("/api/job", "/server/info", "/rr_model")  # the paths at which the kinds report their status
every_kind = pytest.mark.parametrize("kind", KINDS)


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(follow, "POLL_S", 0.02)
    monkeypatch.setattr(follow, "TURN_S", 0.002)
    monkeypatch.setattr(duet, "LOOK_S", 0.01)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.setenv(VARIABLE, KEY)


def unheard(count: int) -> None:
    del count


def ignore(status: PrintStatus, message: str) -> None:
    del status, message


def hand_over(server: PrintServer) -> str:
    server.greet()
    return server.upload(UPLOAD, unheard)


@contextlib.contextmanager
def printing(kind: str, **more: Any) -> Iterator[tuple[Job, PrintServer]]:
    """A server that has the file and takes long to print it."""
    with stand_in(kind, **more) as (job, address), session_with(address) as server:
        hand_over(server)
        job.steps = 10_000
        yield job, server


def run(server: PrintServer, control: Control, on_status: Callable[[PrintStatus, str], None] = ignore) -> PrintState:
    return Follower(server, UPLOAD.name, len(UPLOAD.content), on_status=on_status, control=control, left=lambda: False).run()


@every_kind
def test_a_file_is_handed_over_whole_with_its_progress(kind: str) -> None:
    with stand_in(kind) as (job, address), session_with(address) as server:
        server.greet()
        assert not server.has("box.gcode")
        counts: list[int] = []
        assert server.upload(UPLOAD, counts.append) == "box.gcode"
        assert server.has("box.gcode")
    assert job.files == {"box.gcode": UPLOAD.content}
    assert counts == [*range(0, len(UPLOAD.content), 65536), len(UPLOAD.content)]


def test_a_file_that_moonraker_has_not_scanned_yet_exists() -> None:
    with stand_in("moonraker", scans=False) as (job, address), session_with(address) as server:
        job.files["copied.gcode"] = b""
        assert (server.has("copied.gcode"), server.has("other.gcode")) == (True, False)


@pytest.mark.parametrize(("kind", "path", "value", "picture"), [
    ("moonraker", "/server/webcams/list", {"result": {"webcams": [
        {"enabled": False, "snapshot_url": "/off"}, {"enabled": True, "snapshot_url": "/webcam/?action=snapshot"},
    ]}}, "http://127.0.0.1/webcam/?action=snapshot"),
    ("octoprint", "/api/settings", {"webcam": {"snapshotUrl": "http://localhost:8080/?action=snapshot"}},
     "http://127.0.0.1:8080/?action=snapshot"),
    ("octoprint", "/api/settings", {"webcam": []}, ""), ("moonraker", "/server/webcams/list", [], ""), ("duet", "/none", {}, ""),
])  # fmt: skip
def test_a_server_reports_its_camera_or_none(kind: str, path: str, value: object, picture: str) -> None:
    with stand_in(kind) as (job, address), session_with(address) as server:
        server.greet()
        assert server.webcam() == ""
        job.refuse[path] = (200, value)
        assert server.webcam() == picture


@every_kind
def test_a_print_is_started_and_followed_to_its_end(kind: str) -> None:
    seen: list[PrintStatus] = []
    with stand_in(kind) as (_, address), session_with(address) as server:
        hand_over(server)
        assert run(server, Control(), lambda status, message: seen.append(status)) is PrintState.DONE
    printing = [status for status in seen if status.state is PrintState.PRINTING]
    assert any(0 < (status.bytes_read or 0) < len(UPLOAD.content) for status in printing)
    heat = printing[0].temperature
    assert (heat.nozzle_c, heat.nozzle_target_c, heat.bed_c, heat.bed_target_c) == (209.6, 210.0, 59.9, 60.0)


@every_kind
def test_a_print_is_paused_resumed_and_cancelled_by_the_server(kind: str) -> None:
    control, phases = Control(), list[PrintState]()
    asks = {PrintState.PRINTING: Command.PAUSE, PrintState.PAUSED: Command.RESUME}

    def ask(status: PrintStatus, message: str) -> None:
        if status.state is PrintState.READY or phases[-1:] == [status.state]:
            return
        phases.append(status.state)
        done = len(phases) > 2  # printing, paused, printing
        if status.state in asks:
            control.ask(Command.CANCEL if done else asks[status.state])

    with printing(kind) as (job, server):
        end = run(server, control, ask)
    assert end is PrintState.CANCELLED
    assert job.state == "cancelled"
    assert phases[:3] == [PrintState.PRINTING, PrintState.PAUSED, PrintState.PRINTING]


def test_an_emergency_stop_while_the_user_leaves_is_executed() -> None:
    control = Control()
    with printing("octoprint") as (job, server):

        def left() -> bool:
            if job.state == "printing":
                control.ask(Command.EMERGENCY_STOP)
            return job.state == "printing"

        assert (
            Follower(server, UPLOAD.name, len(UPLOAD.content), on_status=ignore, control=control, left=left).run()
            is PrintState.FAILED
        )
        assert job.commands == ["M112"]


def test_a_stop_without_a_readable_key_is_reported_as_not_confirmed() -> None:
    servers_file().parent.mkdir(parents=True)
    servers_file().write_text("key")
    servers_file().chmod(0o600)
    sentence = rescue(parse_server_address("octoprint:printer"), emergency=True)
    assert sentence.startswith("emergency stop: octoprint:printer did not confirm it: cut the power (file of servers ")


@every_kind
@pytest.mark.parametrize(
    ("printed", "file", "away_s", "reason"),
    [
        ("box.gcode", "box.gcode", 10.0, None),
        ("vase.gcode", "box.gcode", 10.0, "prints vase.gcode now, not box.gcode"),
        ("my_box.gcode", "my box.gcode", 10.0, "prints my_box.gcode now, not my box.gcode"),
        ("", "box.gcode", 10.0, "does not say which file it prints, it may not be box.gcode"),
        ("box.gcode", "box.gcode", 60.0, "may have begun to print box.gcode again since"),
    ],
)
def test_only_the_print_that_was_left_is_cancelled(kind: str, printed: str, file: str, away_s: float, reason: str | None) -> None:
    with stand_in(kind) as (job, address):  # it has been printing for 12 s
        job.files[printed] = UPLOAD.content
        job.steps = 10_000
        job.start(printed)
        with pytest.raises(ServerError, match=reason) if reason else contextlib.nullcontext():
            assert cancel_on_server(parse_server_address(address), file, away_s)
        assert job.state == ("printing" if reason else "cancelled")


@every_kind
def test_nothing_is_cancelled_when_nothing_is_printing(kind: str) -> None:
    with stand_in(kind) as (job, address):
        assert not cancel_on_server(parse_server_address(address), "box.gcode", 10.0)
        assert job.state == "idle"


@every_kind
def test_feed_is_set_and_the_emergency_stop_halts(kind: str) -> None:
    control = Control()
    with printing(kind) as (job, server):
        control.ask(Command.FEED, 120.0)
        control.ask(Command.FLOW, 900.0)  # not possible: reported, not sent

        def stop(status: PrintStatus, message: str) -> None:
            if job.commands:
                control.ask(Command.EMERGENCY_STOP)

        assert run(server, control, stop) is PrintState.FAILED
        assert server.status().state is PrintState.OFFLINE
    assert job.commands[0] == "M220 S120"
    assert job.halted


@pytest.mark.parametrize(("kind", "sent"), [
    ("octoprint", "M290 Z-0.010"), ("duet", "M290 R1 Z-0.010"), ("moonraker", "SET_GCODE_OFFSET Z_ADJUST=-0.010 MOVE=1"),
])  # fmt: skip
def test_a_z_offset_uses_the_command_of_the_firmware_and_is_bounded(kind: str, sent: str) -> None:
    control, told = Control(), set[tuple[float, str]]()
    with printing(kind) as (job, server):
        control.ask(Command.BABYSTEP, -0.01)
        control.ask(Command.BABYSTEP, 2.5)  # not possible: reported, not sent

        def stop(status: PrintStatus, message: str) -> None:
            told.add((status.z_offset_mm, message))
            if status.z_offset_mm:
                control.ask(Command.EMERGENCY_STOP)

        babystep = server.babystep or dialect_of(load().machine).babystep
        left = lambda: False  # noqa: E731
        follower = Follower(server, UPLOAD.name, 1, on_status=stop, control=control, left=left, babystep=babystep)
        assert follower.run() is PrintState.FAILED
    assert job.commands[0] == sent
    assert -0.01 in {offset for offset, _ in told}


def test_z_offsets_that_wait_for_a_slow_server_are_bounded_together() -> None:
    control = Control()
    for _ in range(3):  # the server executes none of them before the last is accepted
        control.ask(Command.BABYSTEP, -0.9)
    with printing("moonraker") as (job, server):

        def stop(status: PrintStatus, message: str) -> None:
            if status.z_offset_mm < -1.0:
                control.ask(Command.EMERGENCY_STOP)

        left, babystep = (lambda: False), server.babystep
        Follower(server, UPLOAD.name, 1, on_status=stop, control=control, left=left, babystep=babystep).run()
    assert job.commands[:3] == ["SET_GCODE_OFFSET Z_ADJUST=-0.900 MOVE=1"] * 2


@pytest.mark.parametrize("end", [PrintState.DONE, PrintState.CANCELLED])
def test_a_z_offset_that_klipper_would_keep_for_the_next_print_is_taken_back(end: PrintState) -> None:
    control, left = Control(), lambda: False
    with printing("moonraker") as (job, server):

        def watch(status: PrintStatus, message: str) -> None:
            if status.z_offset_mm and end is PrintState.CANCELLED:
                control.ask(Command.CANCEL)
            elif status.z_offset_mm:
                job.steps = 1
            elif status.state is PrintState.PRINTING and not job.commands:
                control.ask(Command.BABYSTEP, -0.05)
                job.commands.append("M400")  # requested once

        follower = Follower(server, UPLOAD.name, 1, on_status=watch, control=control, left=left, babystep=server.babystep)
        assert follower.run() is end
    assert job.commands == ["M400", "SET_GCODE_OFFSET Z_ADJUST=-0.050 MOVE=1", "SET_GCODE_OFFSET Z_ADJUST=0.050"]


@every_kind
@pytest.mark.parametrize("end", [PrintState.DONE, PrintState.CANCELLED])
def test_feed_and_flow_are_set_back_when_a_print_ends(kind: str, end: PrintState) -> None:
    control = Control()
    with printing(kind) as (job, server):
        control.ask(Command.FEED, 150.0)
        control.ask(Command.FLOW, 90.0)

        def watch(status: PrintStatus, message: str) -> None:
            if job.commands[-1:] == ["M221 S90"] and end is PrintState.CANCELLED:
                control.ask(Command.CANCEL)
            elif job.commands[-1:] == ["M221 S90"]:
                job.steps = 1

        assert run(server, control, watch) is end
    overrides = [command for command in job.commands if command.startswith("M22")]
    assert overrides == ["M220 S150", "M221 S90", "M220 S100", "M221 S100"]


@every_kind
def test_a_print_cancelled_before_it_was_seen_running_ends_as_cancelled(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("machine.printing.servers.follow.POLL_S", 0.6)
    control = Control()
    control.ask(Command.CANCEL)
    with printing(kind) as (job, server):
        assert run(server, control) is PrintState.CANCELLED
        assert job.state != "printing"


def test_a_feed_without_an_answer_may_be_in_force_and_is_set_back(monkeypatch: pytest.MonkeyPatch) -> None:
    control = Control()
    with printing("moonraker") as (job, server):
        command = server.command

        def silent(line: str) -> None:
            command(line)
            job.steps = 1
            if line == "M220 S150":
                raise NoAnswerError("it has stopped answering")

        monkeypatch.setattr(server, "command", silent)
        control.ask(Command.FEED, 150.0)
        assert run(server, control) is PrintState.DONE
    assert job.commands == ["M220 S150", "M220 S100"]


def test_leaving_a_print_keeps_its_feed_rate_and_says_so() -> None:
    control = Control()
    with printing("moonraker") as (job, server):
        control.ask(Command.FEED, 150.0)
        left = lambda: bool(job.commands)  # noqa: E731
        follower = Follower(server, UPLOAD.name, 1, on_status=ignore, control=control, left=left)
        assert follower.run() is PrintState.LEFT
    assert job.commands == ["M220 S150"]
    assert follower.kept == "the printer keeps the feed of 150 %: before another print send it M220 S100"


def test_a_failed_print_reports_the_settings_that_the_printer_keeps() -> None:
    control = Control()
    with printing("moonraker") as (job, server):
        control.ask(Command.FEED, 150.0)

        def watch(status: PrintStatus, message: str) -> None:
            if job.commands:
                job.state = "error"

        with pytest.raises(ServerError, match="the printer keeps the feed of 150 %: before another print send it M220 S100"):
            run(server, control, watch)


def test_octoprint_does_not_say_whether_the_firmware_knows_a_z_offset() -> None:
    control, messages = Control(), set[str]()
    with printing("octoprint") as (_, server):
        control.ask(Command.BABYSTEP, -0.01)

        def watch(status: PrintStatus, message: str) -> None:
            messages.add(message)
            if message:
                control.ask(Command.EMERGENCY_STOP)

        left = lambda: False  # noqa: E731
        Follower(server, UPLOAD.name, 1, on_status=watch, control=control, left=left, babystep="M290 Z{}").run()
    assert [message.partition("(")[2] for message in messages if message.startswith("sent M290 Z-0.010, but ")] == [
        "Marlin needs BABYSTEPPING): see that the tip moves"
    ]


@every_kind
def test_a_z_offset_is_refused_where_the_firmware_is_not_known(kind: str) -> None:
    control, told = Control(), set[str]()
    with printing(kind) as (job, server):
        control.ask(Command.BABYSTEP, 0.01)

        def stop(status: PrintStatus, message: str) -> None:
            told.add(message)
            control.ask(Command.EMERGENCY_STOP)

        run(server, control, stop)
    assert any(message.startswith("no Z offset") for message in told)
    assert job.commands[:1] in ([], ["M112"])


@every_kind
def test_the_user_leaves_a_print_that_continues(kind: str) -> None:
    with printing(kind) as (job, server):
        left = lambda: job.state == "printing"  # noqa: E731
        assert Follower(server, UPLOAD.name, 1, on_status=ignore, control=Control(), left=left).run() is PrintState.LEFT
        assert job.state == "printing"


@every_kind
@pytest.mark.parametrize(("key", "sentence"), [("another-key", "refuses the"), ("", "wants a")])
def test_a_wrong_or_missing_key_is_one_sentence_without_it(
    kind: str, key: str, sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, key)
    logged: list[bytes] = []
    with (
        stand_in(kind) as (_, address),
        session_with(address, lambda direction, data: logged.append(data)) as server,
        pytest.raises(ServerError, match=sentence) as refused,
    ):
        server.greet()
    assert str(servers_file()) in str(refused.value)
    assert not key or key not in str(refused.value) + str(logged)


@every_kind
def test_no_key_is_in_the_log(kind: str) -> None:
    logged: list[bytes] = []
    with stand_in(kind) as (_, address), session_with(address, lambda direction, data: logged.append(data)) as server:
        hand_over(server)
        assert run(server, Control()) is PrintState.DONE
    assert b"GET" in b"".join(logged)
    assert KEY.encode() not in b"".join(logged)


UPLOADS = {"octoprint": "/api/files/local", "moonraker": "/server/files/upload", "duet": "/rr_upload"}


@every_kind
@pytest.mark.parametrize(
    ("status", "words", "sentence"),
    [
        (413, "Payload Too Large", "has no room for it .Payload Too Large."),
        (507, "Insufficient Storage", "has no room for it"),
        (302, "http://elsewhere/?password=secret", "redirects to .*http://elsewhere/.*no key is carried there"),
        (500, "a \x1b[31mred\x07 page " + "x" * 5000, "refuses the file: .*x\\.\\.\\.$"),
    ],
)
def test_a_refusal_of_a_server_is_one_sentence(kind: str, status: int, words: str, sentence: str) -> None:
    with stand_in(kind) as (job, address), session_with(address) as server:
        server.greet()
        job.refuse[UPLOADS[kind]] = (status, words.encode() if status == 500 else words)
        with pytest.raises(ServerError, match=sentence) as refused:
            server.upload(UPLOAD, unheard)
    assert str(refused.value).isprintable()
    assert "secret" not in str(refused.value)
    assert len(str(refused.value)) < 300


@every_kind
def test_a_key_repeated_by_a_server_is_in_no_message_and_no_log(kind: str) -> None:
    logged: list[bytes] = []
    with stand_in(kind) as (job, address), session_with(address, lambda direction, data: logged.append(data)) as server:
        server.greet()
        job.refuse[UPLOADS[kind]] = (500, f"no such key: {KEY}".encode())
        with pytest.raises(ServerError, match=r"no such key: \*\*\*") as refused:
            server.upload(UPLOAD, unheard)
    assert KEY not in str(refused.value) + str(logged)


@every_kind
def test_half_an_upload_is_no_file(kind: str) -> None:
    with stand_in(kind) as (job, address), session_with(address) as server:
        server.greet()
        job.break_off = UPLOADS[kind]
        with pytest.raises(ServerError, match=r"broke off|breaks off"):
            server.upload(GcodeUpload("box.gcode", LINES * 20), unheard)
    assert job.files == {}


@pytest.mark.parametrize(
    ("kind", "sentence"), [("octoprint", "printing a file of this name now"), ("moonraker", "printing a file of this name now")]
)
def test_a_file_that_is_being_printed_is_not_replaced(kind: str, sentence: str) -> None:
    with stand_in(kind) as (job, address), session_with(address) as server:
        server.start(hand_over(server))
        with pytest.raises(ServerError, match=sentence):
            server.upload(UPLOAD, unheard)
        with pytest.raises(ServerError, match="cannot start it now"):
            server.start("box.gcode")
    assert job.file == "box.gcode"


def test_moonraker_emulating_octoprint_is_recognised() -> None:
    with stand_in("octoprint") as (job, address), session_with(address) as server:
        job.refuse["/api/version"] = (200, b'{"text": "OctoPrint (Moonraker v0.3.1)"}')
        with pytest.raises(ServerError, match="use moonraker:HOST"):
            server.greet()


@pytest.mark.parametrize(("kind", "real"), [("octoprint", "moonraker"), ("moonraker", "duet"), ("duet", "octoprint")])
def test_another_kind_of_server_is_refused(kind: str, real: str) -> None:
    with (
        stand_in(real) as (_, address),
        session_with(address.replace(real, kind, 1)) as server,
        pytest.raises(ServerError),
    ):
        server.greet()


def test_an_expired_session_of_a_duet_is_renewed() -> None:
    sessions: set[str] = set()
    with stand_in("duet", sessions=sessions) as (_, address), session_with(address) as server:
        server.greet()
        sessions.clear()
        assert server.status().state is PrintState.READY


@every_kind
def test_the_loss_of_a_server_during_a_print_is_reported(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    messages: list[str] = []
    with printing(kind) as (job, server):

        def away(status: PrintStatus, message: str) -> None:
            messages.append(message)
            if message:
                monkeypatch.setattr(follow, "LOST_S", 0.0)  # two minutes later
            if status.state is PrintState.PRINTING:
                job.refuse = dict.fromkeys(STATUS, (502, "Bad Gateway"))

        with pytest.raises(ServerError, match="the print may continue: look at the printer"):
            run(server, Control(), away)
    assert re.fullmatch("no answer for [0-9]+ s: whether the print continues there is unknown", messages[-1])


def cancelled_there(job: Job, message: str) -> None:
    job.state = "cancelled"


def another_is_printed(job: Job, message: str) -> None:
    job.files["other.gcode"] = UPLOAD.content
    job.file = "other.gcode"


def dies_and_comes_back(job: Job, message: str) -> None:
    job.refuse = dict.fromkeys(STATUS, (502, "Bad Gateway"))
    if message.startswith("no answer"):
        job.restart()
        job.refuse = {}


HAPPENINGS = [
    (KINDS, dies_and_comes_back, r"no longer prints box\.gcode \(ready\); last known: .*nozzle 210 °C, bed 60 °C"),
    (("octoprint", "moonraker"), cancelled_there, r"no longer prints box\.gcode"),
    (("octoprint", "moonraker"), another_is_printed, r"prints other\.gcode now: what happened to box\.gcode is unknown"),
]


@pytest.mark.parametrize(
    ("kind", "happens", "sentence"), [(kind, happens, words) for kinds, happens, words in HAPPENINGS for kind in kinds]
)
def test_the_outcome_of_a_print_is_reported_as_far_as_it_is_known(
    kind: str, happens: Callable[[Job, str], None], sentence: str
) -> None:
    with printing(kind) as (job, server), pytest.raises(ServerError, match=sentence):
        run(
            server,
            Control(),
            lambda status, message: happens(job, message) if status.state is PrintState.PRINTING or message else None,
        )


def test_a_cancel_that_was_refused_has_cancelled_nothing() -> None:
    class Busy(STAND_INS["octoprint"]):  # type: ignore[misc]
        def answer(self, method: str, path: str, query: dict[str, str], body: bytes) -> tuple[int, object]:
            busy = (method, path) == ("POST", "/api/job")
            return (409, {"error": "it is busy"}) if busy else super().answer(method, path, query, body)

    control = Control()
    with printing("octoprint", handler=Busy) as (job, server):

        def cancel(status: PrintStatus, message: str) -> None:
            if "refuses to cancel" in message:
                job.restart()
            elif status.state is PrintState.PRINTING:
                control.ask(Command.CANCEL)

        with pytest.raises(ServerError, match=r"no longer prints box\.gcode"):
            run(server, control, cancel)


def greet(address: str) -> None:
    with session_with(address) as server:
        server.greet()


def test_an_unknown_name_and_a_closed_port_are_sentences() -> None:
    with socket.create_server(("127.0.0.1", 0)) as held:
        port = held.getsockname()[1]
    with pytest.raises(ServerError, match=f"nothing listens on 127.0.0.1 at port {port}: is Moonraker switched on"):
        greet(f"moonraker:127.0.0.1:{port}")
    with pytest.raises(ServerError, match=r"no computer of the name printer\.invalid is known here"):
        greet("octoprint:printer.invalid")


def test_a_server_that_says_nothing_or_nonsense_is_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(http, "ANSWER_S", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"duet:127.0.0.1:{silent.getsockname()[1]}"
        with pytest.raises(ServerError, match="has stopped answering"):
            greet(address)
        monkeypatch.setattr(http, "ANSWER_S", 10.0)

        def answer() -> None:
            for _ in range(2):
                connection = silent.accept()[0]
            connection.recv(4096)
            connection.sendall(b"220 ftp ready\r\n")

        threading.Thread(target=answer, daemon=True).start()
        with pytest.raises(ServerError, match="speaks no HTTP"):
            greet(address)


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A key and its self-signed certificate for 127.0.0.1."""
    if shutil.which("openssl") is None:
        pytest.skip("openssl makes the certificate")
    file = tmp_path_factory.mktemp("tls") / "server.pem"
    words = "req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=printer"
    command = ["openssl", *words.split(), "-addext", "subjectAltName=IP:127.0.0.1", "-keyout", str(file), "-out", f"{file}.crt"]
    subprocess.run(command, check=True, capture_output=True)
    file.write_text(file.read_text() + Path(f"{file}.crt").read_text())
    return file


def test_an_unknown_certificate_is_refused_until_its_authority_is_named(certificate: Path) -> None:
    with stand_in("moonraker", certificate=certificate) as (job, address):
        with pytest.raises(ServerError, match=r"certificate cannot be trusted .self-signed certificate.*ca_file"):
            greet(address)
        assert job.asked == []
        servers_file().parent.mkdir(parents=True)
        servers_file().write_text(f'[servers."127.0.0.1"]\nca_file = "{certificate}.crt"\n')
        servers_file().chmod(0o600)
        greet(address)
        servers_file().write_text('[servers."127.0.0.1"]\nca_file = "/nowhere.pem"\n')
        with pytest.raises(ServerError, match=r"ca_file /nowhere.pem .* holds no certificates: No such file"):
            greet(address)


def test_tls_to_a_server_without_it_is_a_sentence() -> None:
    no_tls = pytest.raises(ServerError, match="speaks no TLS: is it http:// instead of https://")
    with stand_in("moonraker") as (_, address), no_tls:
        greet(address.replace("http:", "https:"))


def any_value(draw: random.Random, depth: int = 0) -> object:
    """A JSON value of any shape, with the names that the servers use."""
    names = ("result", "state", "error", "status", "job", "files", "local", "path", "err", "flags", "message", "heat", "heaters")
    kind = draw.randrange(8 if depth < 4 else 6)
    if kind == 6:
        return [any_value(draw, depth + 1) for _ in range(draw.randrange(3))]
    if kind == 7:
        return {draw.choice(names): any_value(draw, depth + 1) for _ in range(draw.randrange(5))}
    return (None, True, -(10**400), 1e308, "\x1b]0;x\x07", "ready")[kind]


@every_kind
def test_any_answer_of_a_server_gives_a_sentence_or_a_value(kind: str) -> None:
    draw = random.Random(kind)

    class AnyAnswer(STAND_INS[kind]):  # type: ignore[misc]
        def answer(self, method: str, path: str, query: dict[str, str], body: bytes) -> tuple[int, object]:
            usual = super().answer(method, path, query, body)
            return usual if draw.random() < 0.3 else (draw.choice((200, 201, 200, 404, 409, 500)), any_value(draw))

    with stand_in(kind, handler=AnyAnswer) as (_, address):
        for _ in range(60):
            with session_with(address) as server:
                calls: list[Callable[[], object]] = [
                    server.greet,
                    server.status,
                    lambda: server.has("box.gcode"),
                    lambda: server.order(Command.PAUSE),
                ]
                for call in [*calls, lambda: server.upload(UPLOAD, unheard), lambda: server.command("M220 S90")]:
                    with contextlib.suppress(ServerError):
                        call()


def test_an_endless_answer_is_not_stored(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(http, "MOST_BYTES", 1_000_000)
    with stand_in("octoprint") as (job, address), session_with(address) as server:
        job.refuse["/api/version"] = (200, b"x" * 2_000_000)
        with pytest.raises(ServerError, match="answers with more than 1 MB: it is not a print server"):
            server.greet()


def test_an_answer_that_drips_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(http, "WHOLE_S", -1.0)
    no_end = pytest.raises(NoAnswerError, match="sends an answer without an end")
    with stand_in("octoprint") as (_, address), session_with(address) as server, no_end:
        server.greet()


class Unanswered:
    """A server that receives the order to start without answering it; status() calls the given function."""

    name, tells_percents = "octoprint:host", True

    def __init__(self, status: Callable[[], PrintStatus]) -> None:
        self.status = status

    def start(self, file: str) -> None:
        raise NoAnswerError("it has stopped answering")


def follow_unanswered(status: Callable[[], PrintStatus]) -> PrintState:
    server: object = Unanswered(status)
    return Follower(server, "box.gcode", 9, on_status=ignore, control=Control(), left=lambda: False).run()  # type: ignore[arg-type]


def test_a_print_whose_start_was_not_answered_is_followed_anyway() -> None:
    phases = iter([PrintState.PRINTING] * 20)
    assert follow_unanswered(lambda: PrintStatus(next(phases, PrintState.DONE), file="box.gcode")) is PrintState.DONE


def test_the_end_of_an_earlier_print_is_not_taken_for_ours(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(follow, "BEGIN_S", 0.1)
    with pytest.raises(ServerError, match="has not begun to print within"):
        follow_unanswered(lambda: PrintStatus(PrintState.DONE, file="other.gcode"))


def test_a_server_that_never_answers_counts_as_lost_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(follow, "LOST_S", 0.1)
    over = threading.Event()
    monkeypatch.setattr(follow, "JOIN_S", 0.01)
    try:
        with pytest.raises(ServerError, match="octoprint:host; no answer for 0 s: the print may continue: look at the printer"):
            follow_unanswered(lambda: PrintStatus(PrintState.READY if over.wait(60.0) else PrintState.FAILED))
    finally:
        over.set()


def test_a_server_that_answers_nothing_but_errors_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(follow, "LOST_S", 0.2)
    looks = iter(range(300))

    def status() -> PrintStatus:
        if (look := next(looks)) == 0:
            return PrintStatus(PrintState.PRINTING, file="box.gcode")
        raise ServerError("octoprint:host refuses") if look < 299 else ZeroDivisionError

    with pytest.raises(
        ServerError, match="octoprint:host refuses; no answer for 0 s: the print may continue: look at the printer"
    ):
        follow_unanswered(status)


def test_an_error_of_a_thread_is_not_lost() -> None:
    def broken() -> PrintStatus:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        follow_unanswered(broken)


def test_a_duet_that_does_not_start_says_why() -> None:
    with stand_in("duet") as (job, address), session_with(address) as server:
        file = hand_over(server)
        job.refuse["/rr_gcode"] = (200, {"buff": 240})
        job.refuse["/rr_reply"] = (200, b"Error: M32: Cannot set file to print, because a file is already being printed\n")
        with pytest.raises(ServerError, match="cannot start it now: Error: M32: Cannot set file to print"):
            server.start(file)


@pytest.mark.parametrize("kind", ["octoprint", "moonraker"])
def test_a_start_that_is_refused_ends_with_the_server_s_words(kind: str) -> None:
    with printing(kind) as (job, server):
        job.files["other.gcode"] = UPLOAD.content
        job.start("other.gcode")
        with pytest.raises(ServerError, match=r"cannot start it now: (SD busy|Printer is already printing)"):
            run(server, Control())
