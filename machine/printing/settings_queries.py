"""Settings queries: the settings that a printer reports at a port or through a print server, as text for detection.

Nothing moves or heats; a printer that is printing is left alone.
"""

import re
from collections.abc import Iterator
from time import monotonic

from machine.firmware import identify
from machine.link.identification import GRBL_SAYS, Kind, ask_at_any_rate
from machine.link.port import Port
from machine.printing.checks import check_idle
from machine.printing.destination import Destination, Server
from machine.printing.ports import check_answer, open_line, rate_of
from machine.printing.servers.duet import SETTINGS_ARRAYS, SETTINGS_KEYS
from machine.printing.servers.servers import open_server
from machine.setup.detect.found import ConfigText
from profiles.errors import PrinterError, SilenceError
from profiles.machine import Machine
from profiles.messages import option

ANSWER_S = 5.0  # M503 of a full build is some 4 KiB, half a second at 115200 baud
OK = re.compile(r"ok\b.*")
QUIET_S = 0.25  # silence that ends the answers to earlier queries
# Answers of a busy printer: Marlin's to M27 (sd/cardreader.cpp), RepRapFirmware's object model, and grblHAL.
WORK = "processing|simulating|pausing|paused|resuming|cancelling|busy|changingTool"
AT_WORK = re.compile(rf'.*(?:SD printing byte|"state\.status".*"result":"(?:{WORK})").*')
CUT = re.compile(r'"next":([1-9]\d*)\}$')
MOST_PAGES = 16
QUESTIONS = {
    "Marlin": ("M27", "M115", "M503", "M203", "M211"),
    "RepRapFirmware": tuple(f'M409 K"{key}" F"d99vn"' for key in ("state.status", *SETTINGS_ARRAYS, *SETTINGS_KEYS)),
    "grblHAL": ("$I", "$$"),
}
OTHERWISE = {
    "Klipper": f"Klipper reports its settings over the network, to {option('port')} moonraker:HOST, and in its file printer.cfg",
}


def settings_text(at: Destination, simulated: Machine) -> ConfigText:
    """Query the settings; simulated: the machine of the simulated printer. Raises PrinterError."""
    if isinstance(at, Server):
        with open_server(at) as server:
            server.greet()
            check_idle(server.name, server.status())
            return ConfigText(at.name, server.settings())
    with open_line(at, simulated) as wire:
        return ConfigText(at.name, _conversation(wire, rate_of(at)))


def _conversation(wire: Port, baud: int) -> str:
    answer, rate = ask_at_any_rate(wire, baud)
    if answer.kind is Kind.STRANGER and rate == baud and GRBL_SAYS.fullmatch(answer.words):
        name = "grblHAL"
    else:
        check_answer(answer, wire.name, baud, rate)
        firmware = identify(answer.words)
        name = firmware.name if firmware is not None else ""
    if name not in QUESTIONS:
        words, known = answer.firmware or "of an unnamed firmware", ", ".join(QUESTIONS)
        unknown = f"the printer at {wire.name} is {words}, whose settings cannot be queried at a port: those of {known} can"
        raise PrinterError(OTHERWISE.get(name, unknown))
    _hear_out(wire)
    return "\n".join(line for question in QUESTIONS[name] for line in _pages(wire, question))


def _hear_out(wire: Port) -> None:
    """Read late answers, so that none is taken for the answer to the next query."""
    quiet_s, end_s = monotonic() + QUIET_S, monotonic() + ANSWER_S
    while (now_s := monotonic()) < min(quiet_s, end_s):
        if wire.read():
            quiet_s = now_s + QUIET_S


def _pages(wire: Port, question: str) -> Iterator[str]:
    """The lines of an answer; where RepRapFirmware truncates an array, the query is repeated from there."""
    for _ in range(MOST_PAGES):
        answer = list(_ask(wire, question))
        yield from answer
        if not (cut := CUT.search(answer[-1] if answer else "")):
            return
        question = f'{question.partition(" F")[0]} F"d99vna{cut[1]}"'


def _ask(wire: Port, question: str) -> Iterator[str]:
    """The lines of an answer before its ok. Raises SilenceError."""
    wire.write(f"{question}\n".encode("ascii"))
    half, end_s = b"", monotonic() + ANSWER_S
    while monotonic() < end_s:
        *lines, half = (half + wire.read()).replace(b"\r", b"\n").split(b"\n")
        for line in lines:
            text = line.decode("utf-8", "replace").strip()
            if OK.fullmatch(text):
                return
            if AT_WORK.fullmatch(text) or GRBL_SAYS.fullmatch(text):
                raise PrinterError(f"the printer at {wire.name} is at work ({text[:80]}): try again when that is done")
            if text:
                yield text
    raise SilenceError(f"the printer at {wire.name} does not answer {question} within {ANSWER_S:g} s: try it again")
