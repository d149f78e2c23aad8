"""Printing from the workbench on the simulated printer: refusals, control by one page, and the commands sent."""

import json
import re
import signal
import socket
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from machine.cli.cli import main
from machine.link.journal import read_journal
from machine.printing.servers.http import VARIABLE
from machine.simulator.faults import Fault
from machine.simulator.simulator import SimulatedPrinter
from mdp.save import stl
from profiles.profile import load
from tests.machine.browser import CHROMIUM, Browser
from tests.machine.printing.servers.stand_ins import KEY, stand_in
from tests.machine.prints import commands_sent, kinds_of_fields, prints_line
from tests.machine.running_workbench import QUICK, Running, workbench
from tests.shapes import box

# The process of a print queries its server often.
HASTY = """
from machine.workbench.printing import running_print
running_print.MAIN = f"from machine.printing.servers import follow; follow.POLL_S = 0.1; {running_print.MAIN}"
"""
PRINTING, VIEW = "document.documentElement.dataset.printing", "$('print-page').contentDocument"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    parent = tmp_path_factory.mktemp("box")
    (parent / "box.stl").write_bytes(stl(box(12.0, 12.0, 8.0)))
    return parent


@pytest.fixture(scope="module")
def key() -> Iterator[None]:
    """The key of the print server's stand-in, in the environment of the workbench and the command line."""
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv(VARIABLE, KEY)
        yield


@pytest.fixture(scope="module")
def sliced(folder: Path, key: None) -> Iterator[Running]:
    """A workbench on which a small box is sliced in one piece."""
    with workbench(*QUICK, before=HASTY) as running:
        with running.line() as page, prints_line(running, "first") as printing:
            printing.do("check", port="sim")
            assert printing.refused() == "there is no model on the workbench yet: choose a file first"
            assert running.send(folder / "box.stl")[0] == 200
            page.until(lambda state: state["model"])
            printing.do("check", port="sim")
            assert printing.refused() == "what is on the workbench is not sliced yet: slice it first"
            page.do("slice")
            page.until(lambda state: state["sliced"])
            page.do("turn", axis="z", deg=30)
            page.until(lambda state: state["sliced"]["stale"])
            printing.do("check", port="sim")
            assert printing.refused() == "what is on the workbench has changed since it was sliced: slice it again"
            page.do("undo")
            page.until(lambda state: not state["sliced"]["stale"])
        yield running


@pytest.mark.parametrize(("port", "sentence"), [
    ("", "no printer is chosen: choose a port, or sim for the simulated one"),
    ("octoprint:me:secret@host", "server address: it must not hold a name or password: keys have a file of their own"),
])  # fmt: skip
def test_an_invalid_port_is_reported(sliced: Running, port: str, sentence: str) -> None:
    with prints_line(sliced, "first") as page:
        page.do("check", port=port)
        assert page.refused().startswith(sentence)


@pytest.mark.parametrize(("journal", "sentence"), [
    (" ", "no journal is chosen: choose the print to resume, or name the journal's file"),
    ("a\0b", r"'a\x00b' is not a file name: it has a character that no name may have"),
])  # fmt: skip
def test_an_invalid_journal_is_reported(sliced: Running, journal: str, sentence: str) -> None:
    with prints_line(sliced, "first") as page:
        page.do("go_on", journal=journal, port="/dev/none")
        assert page.refused() == sentence


def listen_to_nothing(running: Running) -> socket.socket:
    """A page's connection to the prints that is opened and never read."""
    own = socket.create_connection(("127.0.0.1", running.port))
    own.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1024)
    own.sendall(
        f"GET {running.place}prints?page=deaf HTTP/1.1\r\nHost: 127.0.0.1:{running.port}\r\n"
        f"Origin: http://127.0.0.1:{running.port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n".encode()
    )
    return own


def test_pages_that_read_nothing_leave_the_print_what_the_command_line_sends(sliced: Running, folder: Path) -> None:
    by_hand = ("print", str(folder / "box.stl"), *QUICK, "--parts", "1", "--port", "sim", "--log", str(folder / "own.log"))
    assert main(by_hand) == 0
    with ExitStack() as stack, prints_line(sliced, "first") as page:
        for _ in range(8):
            stack.enter_context(listen_to_nothing(sliced))
        page.do("check", port="sim")
        page.until(lambda seen: seen["state"] == "ready")
        page.command("begin")
        done = page.until(lambda seen: seen["is_over"])
        page.command("forget")
        page.until(lambda seen: not seen["state"])
    assert done["sentence"] == "the print is done"
    assert commands_sent(Path(done["log"])) == commands_sent(folder / "own.log")


@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: the page is not tried in a browser")
def test_a_page_prints_another_watches_takes_over_and_every_key_e_stops_the_machine(sliced: Running) -> None:
    with Browser((1000, 700)) as browser, prints_line(sliced, "other") as second_page:
        browser.open(sliced.address)
        browser.click("#tab-printing")
        browser.wait("document.documentElement.dataset.line === 'open' && $('unsliced').hidden")
        browser.value("$('sim-speed').value = '60'")
        browser.click("#check")
        browser.wait("!$('run-ask').hidden")
        assert "no error" in browser.value("$('run-checks').textContent")
        second_page.do("check", port="sim")
        assert second_page.refused() == "port sim prints already: wait until that is done, or cancel it"
        second_page.until(lambda seen: seen["state"] == "ready")
        second_page.command("begin")
        assert second_page.refused() == "another page controls this print: take control first"

        browser.click("#begin")
        browser.wait(f"{PRINTING} === 'printing' && $('run-told').textContent.includes('layer')")
        browser.value("{ $('feed').value = 20; $('feed').dispatchEvent(new Event('change')); }")
        assert second_page.until(lambda seen: seen.get("feed_percent") == 20.0)["holder"] != "other"
        browser.click("#pause")
        browser.wait(f"{PRINTING} === 'paused' && $('pause').textContent === 'Resume'")
        browser.click("#pause")
        browser.wait(f"{PRINTING} === 'printing'")

        browser.open(sliced.address)  # a reloaded page still controls its print
        browser.wait(f"{PRINTING} === 'printing' && !$('run-commands').hidden && $('held').hidden")
        browser.click("[data-babystep='0.05']")
        browser.wait("$('offset-told').textContent === '+0.05 mm'")

        second_page.command("take")
        browser.wait("!$('held').hidden && $('run-commands').hidden")
        assert "Another page has taken control" in browser.value("$('notice').textContent")
        browser.open(sliced.address)  # the page that started the print is gone, the print is not
        browser.wait(f"{PRINTING} === 'printing' && !$('print-bar').hidden")
        assert json.loads(browser.value("JSON.stringify([$('run-commands').hidden, $('held').hidden])")) == [True, False]
        browser.click("#tab-printing")
        second_page.command("pause")  # so that it is not done before it is stopped, even on a slow computer
        browser.wait(f"{PRINTING} === 'paused'")
        second_page.do("check", port="/dev/none")
        browser.wait("$('which').options.length === 2")
        assert browser.value(PRINTING) == "paused"  # neither the print shown nor the one that the button stops has changed
        second_page.until(lambda seen: seen["is_over"])
        second_page.command("forget")
        second_page.until(lambda seen: seen["state"] == "paused")
        browser.value("{ $('printer-field').open = true; $('port-typed').focus(); }")
        browser.key("e")  # a letter of the port's name
        assert browser.value("$('port-typed').value") == "e"
        assert browser.value(PRINTING) == "paused"
        browser.click("#follow")
        browser.wait(f"['ready', 'failed'].includes({VIEW}?.documentElement?.dataset.state)")
        browser.click("#level-all")  # so that every setting has its field
        typed, stopping = kinds_of_fields(browser)
        assert typed == ["number", "search", "select-one", "text", "textarea"]
        assert not set(typed) & set(stopping)
        browser.value(f"{VIEW}.querySelector('button').focus()")
        sliced.process.send_signal(signal.SIGSTOP)  # the workbench hangs while the user presses the key
        try:
            browser.key("e")
            browser.key("e")
            browser.wait("$('stop-words').textContent === \"THE STOP IS NOT CONFIRMED: use the machine's own switch.\"")
            assert browser.value("$('stop-words').checkVisibility()")
            browser.wait("$('bar-told').textContent.includes('nothing heard of it for ')")
        finally:
            sliced.process.send_signal(signal.SIGCONT)
        browser.wait(f"{PRINTING} === 'over' && $('emergency').hidden")
        assert browser.value("$('stop-words').textContent").startswith("box.stl: emergency stop: the printer has halted")
        assert browser.value("$('run-state').textContent").startswith("emergency stop: the printer has halted")
        heat = browser.value("[...$('run-told').children].map((each) => each.textContent).filter((text) => text.includes('°C'))")
        assert len(heat) == 2
        assert all(re.fullmatch(r"off, [\d.]+ °C \(\d+ s ago\)", text) for text in heat)
        assert browser.value("$('run-told').querySelector('.old')") is None
        assert "M112" in commands_sent(Path(second_page.until(lambda seen: seen["is_over"])["log"]))
        second_page.command("forget")
        browser.wait(f"{PRINTING} === ''")
        assert browser.value("$('stop-words').checkVisibility()")  # until it is noted, even after the print is removed
        assert browser.complaints == []


@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: the page is not tried in a browser")
def test_on_a_phone_nothing_covers_print_now_and_a_print_is_followed_in_a_picture_without_readouts(sliced: Running) -> None:
    with Browser((390, 640)) as browser:
        browser.open(sliced.address)
        browser.click("#tab-printing")
        browser.wait("document.documentElement.dataset.line === 'open' && $('unsliced').hidden")
        browser.value("{ $('port-sim').click(); $('sim-speed').value = '1'; }")
        browser.click("#check")
        browser.wait("!$('run-ask').hidden")
        browser.value("{ for (let k = 0; k < 20; k++) $('run-checks').append(document.createElement('li')); }")
        on_top = "(({ x, y, height }) => document.elementFromPoint(x + 20, y + height - 2)?.id)($('%s').getBoundingClientRect())"
        assert browser.value(on_top % "begin") == "begin"
        sign, amber = browser.value("(({ listStyleType, color }) => [listStyleType, color])(getComputedStyle($('run-findings')))")
        assert (sign, amber) == ('"⚠ "', "rgb(154, 91, 0)")
        browser.press(*browser.middle("#begin"))
        browser.wait(f"{PRINTING} === 'printing' && !$('follow').hidden")
        assert browser.value(on_top % "pause") == "pause"
        browser.click("#cancel")  # asks for confirmation, during which the emergency stop looks enabled
        assert browser.value("getComputedStyle($('sure'), '::backdrop').backgroundColor") == "rgba(0, 0, 0, 0)"
        assert browser.value(on_top % "emergency") == "emergency"
        browser.click("#go-on")
        browser.value("document.activeElement.blur()")
        browser.key("?")
        assert browser.value("$('keys').matches(':popover-open')")
        assert browser.value(on_top % "emergency") == "emergency"  # a click there stops the machine, too
        browser.click("#keys-close")
        assert not browser.value("$('keys').matches(':popover-open')")
        browser.value("$('follow').scrollIntoView({ block: 'center' })")
        assert browser.value(on_top % "follow") == "follow"
        browser.press(*browser.middle("#follow"))
        browser.wait(f"['ready', 'failed'].includes({VIEW}?.documentElement?.dataset.state)")
        browser.wait("(({ top, bottom }) => top > -5 && bottom > 150)($('scene').getBoundingClientRect())")  # scrolled there
        readouts = ("readouts", "legend")
        assert not [name for name in readouts if browser.value(f"{VIEW}.getElementById('{name}').checkVisibility()")]
        assert browser.value(f"{VIEW}.getElementById('canvas').clientHeight") > 150
        browser.click("#cancel-surely")
        browser.wait(f"{PRINTING} === 'over'")
        assert browser.complaints == []


def type_port(browser: Browser, port: str) -> None:
    browser.click("#port-other")
    browser.value(f"$('port-typed').value = {json.dumps(port)}")
    browser.value("$('port-typed').dispatchEvent(new Event('input', { bubbles: true }))")


def test_a_page_prints_on_a_print_server_finds_the_print_again_leaves_it_printing_and_follows_it_again(
    sliced: Running, browser: Browser
) -> None:
    with stand_in("octoprint") as (job, address), prints_line(sliced, "other") as second_page:
        job.steps = 200
        browser.open(sliced.address)
        browser.click("#tab-printing")
        browser.wait("document.documentElement.dataset.line === 'open' && $('unsliced').hidden")
        type_port(browser, address)
        assert browser.value("$('baud-line').hidden && $('sim-speed-line').hidden && !$('port-hint').hidden")
        browser.click("#check")
        browser.wait("!$('run-ask').hidden")
        checks = browser.value("$('run-checks').textContent")
        assert f"OctoPrint 1.11.8 answers at {address}, is free" in checks
        assert "there is no journal to resume from after a power cut" in checks
        assert job.files == {}
        browser.click("#begin")
        browser.wait(f"{PRINTING} === 'printing' && $('run-told').textContent.includes('line')")
        assert job.files["box.stl.gcode"] == sliced.ask("print.gcode")[1]
        browser.value("{ $('feed').value = 150; $('feed').dispatchEvent(new Event('change')); }")
        browser.click("#pause")
        browser.wait(f"{PRINTING} === 'paused' && $('pause').textContent === 'Resume'")
        assert (job.state, job.commands) == ("paused", ["M220 S150"])
        browser.wait("$('feed-told').textContent === '150 %'")  # although this server does not report it
        second_page.until(lambda seen: seen.get("port") == address and seen["state"] == "paused")
        second_page.command("resume")
        assert second_page.refused() == "another page controls this print: take control first"

        browser.open(sliced.address)
        browser.wait(f"{PRINTING} === 'paused' && !$('print-bar').hidden")
        browser.click("#tab-printing")
        browser.click("#take")
        browser.wait("!$('run-commands').hidden && !$('leave-printing').hidden")
        browser.click("#pause")
        browser.wait(f"{PRINTING} === 'printing'")
        browser.click("#leave-printing")
        browser.wait(f"{PRINTING} === 'over'")
        assert (
            browser.value("$('run-state').textContent") == f"box.stl keeps printing on {address}: this page no longer follows it"
        )
        assert job.state == "printing"
        type_port(browser, address)
        browser.click("#follow-server")
        browser.wait("$('run-title').textContent.startsWith('box.stl.gcode on octoprint:') && !$('run-commands').hidden")
        browser.wait("/nozzle209.6 of 210 .C.*elapsed/.test($('run-told').textContent)")  # reported with the first answer
        browser.click("#cancel")
        browser.click("#cancel-surely")
        browser.wait(f"{PRINTING} === 'over'")
        assert browser.value("$('run-state').textContent").startswith(f"the print was cancelled on {address}")
        assert job.state == "cancelled"
        job.files.clear()
        browser.click("#send-only")
        browser.click("#check")
        browser.wait("$('begin').textContent === 'Upload' && !$('run-ask').hidden")
        assert "nothing prints until someone starts it there" in browser.value("$('ask-told').textContent")
        browser.click("#begin")
        browser.wait(f"{PRINTING} === 'over'")
        assert (browser.value("$('run-state').textContent"), job.state) == (f"box.stl.gcode waits on {address}", "cancelled")
        assert job.files["box.stl.gcode"] == sliced.ask("print.gcode")[1]
        assert KEY not in json.dumps(second_page.state)
        assert browser.complaints == []


def homed(printer: SimulatedPrinter) -> list[str]:
    return [event for _, event in printer.record.events if event.startswith("homed")]


def test_a_print_ended_by_a_power_cut_is_resumed_from_the_page(sliced: Running, browser: Browser) -> None:
    cut = Fault("reset", at=265, unit="line")  # not in a lifted travel, after which its height would be uncertain
    with SimulatedPrinter(load().machine, faults=[cut]) as printer, prints_line(sliced, "first") as page:
        page.do("check", port=printer.path)
        page.until(lambda seen: seen["state"] == "ready")
        page.command("begin")
        ended = page.until(lambda seen: seen["is_over"])
        assert "the printer restarted in the middle of the print" in ended["sentence"]
        browser.open(sliced.address)
        browser.click("#tab-printing")
        browser.wait("document.documentElement.dataset.line === 'open'")
        browser.wait("document.documentElement.dataset.printing === 'over'")  # this closes an earlier print that is open
        type_port(browser, printer.path)
        browser.click("#rest-field summary")
        browser.wait(f"document.querySelector(`#journals input[value={json.dumps(ended['journal'])}]`)")
        browser.click(f"#journals input[value={json.dumps(ended['journal'])}]")
        browser.click("#go-on-with")
        browser.wait("!$('run-ask').hidden")
        assert "box.stl, part 1 of 1" in browser.value("$('run-checks').textContent")
        asked = browser.value("$('ask-told').textContent").splitlines()
        assert "the printer has restarted" in asked[0]
        assert asked[1].startswith("look first: all must stand as it was cut off, tip at X")
        by_another_name = "{0}/../{0.name}/{1}".format(Path(ended["journal"]).parent, Path(ended["journal"]).name)
        page.do("go_on", journal=by_another_name, port="/dev/another")
        assert page.refused() == f"journal {by_another_name}: its print has been resumed already, or has not ended"
        browser.click("#leave")
        browser.wait(f"{PRINTING} === 'over'")
        assert browser.value("$('run-state').textContent") == "nothing was moved or heated"
        assert homed(printer) == ["homed XYZ"]

        page.until(lambda seen: seen["state"] == "declined")
        page.do("go_on", journal=ended["journal"], port=printer.path)
        page.until(lambda seen: seen["state"] == "ready")
        page.command("begin")
        rest = page.until(lambda seen: seen["is_over"])
        assert rest["sentence"] == "the print is done"
        assert homed(printer) == ["homed XYZ", "homed XY"]
    first, second = (read_journal(Path(ended_print["journal"])) for ended_print in (ended, rest))
    assert (first.last.continued_in, second.finished) == (rest["journal"], True)
    assert browser.complaints == []


def test_a_printer_is_heated_homed_moved_and_released_from_the_page(sliced: Running, browser: Browser) -> None:
    with SimulatedPrinter(load().machine) as printer:
        browser.open(sliced.address)
        browser.click("#tab-printing")
        browser.wait("document.documentElement.dataset.line === 'open'")
        type_port(browser, printer.path)
        browser.click("#hand")
        browser.wait(f"{PRINTING} === 'manual control' && $('hand-live').checkVisibility()")
        browser.wait("$('run-told').textContent.includes('nozzle20.0 °C')")
        assert browser.value("[...$('hand-jog').children].every((button) => button.disabled) && $('emergency').checkVisibility()")
        browser.click("[data-hand=heat]")
        browser.wait("/nozzle[0-9.]+ of 215 °C/.test($('run-told').textContent)")
        browser.click("#hand-home")
        browser.click("#hand-not")
        assert (browser.value("$('hand-sure').checkVisibility()"), homed(printer)) == (False, [])
        browser.click("#hand-home")
        browser.click("[data-hand=home]")
        browser.wait("[...$('hand-jog').children].every((button) => !button.disabled)")
        assert homed(printer) == ["homed XYZ"]
        browser.click("[data-jog='X+']")
        browser.wait("$('run-told').textContent.includes('X -159.0')")
        browser.value("{ $('hand-step').value = '10'; }")
        browser.click("[data-jog='X-']")
        browser.wait("$('run-state').textContent === 'manual control · X would be -169.00 mm: -160 to 160 are allowed'")
        browser.wait("!$('heat').hidden && $('heat-nozzle').getAttribute('d').split('L').length > 2")
        began = browser.value("modules['print/print-shown'].SAMPLES.get(Number($('which').value)).at(0).at_s")
        browser.open(sliced.address)
        browser.wait("!$('heat').hidden")
        assert browser.value("modules['print/print-shown'].SAMPLES.get(Number($('which').value)).at(0).at_s") == began
        browser.click("#take")
        browser.wait("$('held').hidden")
        browser.click("[data-hand=let_go]")
        browser.wait(f"{PRINTING} === 'over' && $('run-state').textContent === 'disconnected; the heaters are off'")
        assert (printer.record.nozzle_target_c, printer.record.bed_target_c) == (0.0, 0.0)
        browser.click("#forget")
    assert browser.complaints == []


def test_print_under_the_verdict_checks_at_the_printer_of_last_time_and_moves_and_heats_nothing(
    sliced: Running, browser: Browser
) -> None:
    with SimulatedPrinter(load().machine) as printer, prints_line(sliced, "first") as page:
        page.do("check", port=printer.path)
        page.until(lambda seen: seen["state"] == "ready")
        page.command("cancel")
        page.until(lambda seen: seen["is_over"])
        browser.open(sliced.address)
        browser.wait("document.documentElement.dataset.line === 'open'")
        browser.click("#tab-slices")
        browser.wait("$('verdict-print').checkVisibility() && $('port-typed').value")
        browser.click("#look")
        browser.click("#bar-print")  # also offered under the verdict
        browser.wait(f"{PRINTING} === 'ready' && $('begin').checkVisibility()")
        assert browser.value("$('port-typed').value") == printer.path
        assert (printer.record.events, printer.record.moves) == ((), 0)
        assert (printer.record.nozzle_target_c, printer.record.bed_target_c) == (0.0, 0.0)
        browser.click("#leave")
        browser.wait(f"{PRINTING} === 'over'")
    assert browser.complaints == []


def test_ctrl_c_at_the_terminal_ends_the_print_first_with_its_heaters_off(sliced: Running) -> None:
    """The last test: it ends the workbench of the others."""
    with SimulatedPrinter(load().machine, speed=20.0) as printer, prints_line(sliced, "first") as page:
        page.do("check", port=printer.path)
        page.until(lambda seen: seen["state"] == "ready")
        page.command("begin")
        page.until(lambda seen: seen.get("nozzle_target_c"))
        sliced.process.send_signal(signal.SIGINT)
        ended = page.until(lambda seen: seen["is_over"])
        assert sliced.process.wait(60.0) == 0
        assert (printer.record.nozzle_target_c, printer.record.bed_target_c) == (0.0, 0.0)
    assert ended["said"][-2].endswith("; heaters off")
    assert ended["said"][-1] == f"tiltprint resume {ended['journal']} continues it"
