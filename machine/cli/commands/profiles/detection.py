"""The profiles detect command: makes a machine profile from the settings of a firmware, and lists those it does not report."""

import json
import sys
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Iterator, Sequence
from glob import glob, has_magic
from pathlib import Path

from machine.cli.terminal.requests import DetectRequest
from machine.firmware.firmware import check_baud
from machine.notices import plain_lines, say
from machine.pipeline.output import check_writable, plain_name, refuse_to_overwrite, write_own
from machine.pipeline.profile_file import profile_text
from machine.printing.destination import parse_destination
from machine.printing.settings_queries import settings_text
from machine.setup.detect.found import ConfigText, Found
from machine.setup.detect.proposal import CALIBRATED, Proposal, propose, read, settings_of
from profiles.errors import ProfileError, reason
from profiles.machine import Machine
from profiles.messages import terminal_words
from profiles.places import own_folder
from profiles.profile import DEFAULTS, load_one
from profiles.toml_text import value_text

MOST_BYTES = 4 << 20  # size limit of a configuration; long ones have 200 KiB


def detect(request: DetectRequest) -> int:
    """Query the firmware or read a file, write the profile, and list reported, inherited and unmeasured values."""
    check_baud(request.baud)
    if request.out is not None:
        check_writable(request.out)
        refuse_to_overwrite(request.out, request.replace)
    found = read(_config(request))
    proposal = propose(found, request.base)
    out = request.out or own_folder("machine") / f"{_stem(found, request)}.toml"
    refuse_to_overwrite(out, request.replace)
    name = found.name or out.stem
    try:
        text = profile_text("machine", proposal.base, settings_of(proposal, name, found.firmware), proposal.values)
    except ProfileError as error:
        first, *_ = str(error).splitlines()
        raise ProfileError(f"{request.port or request.file}: its values are not those of a machine: {first}") from None
    write_own(out, text, request.replace)
    use = out.stem if request.out is None else str(out)
    table = "\n".join(_lines(found, proposal, use))
    sys.stdout.write(_as_json(found, proposal, out) if request.json else plain_lines(table) + "\n")
    say(f"saved: {out}; use it as --machine {use}")
    return 0


def _stem(found: Found, request: DetectRequest) -> str:
    """File name after the machine, else after the file that was read."""
    named = found.name or (request.file.stem if request.file is not None else "") or found.dialect
    return plain_name(named).strip("._") or found.dialect


def _config(request: DetectRequest) -> ConfigText:
    if request.file is not None:
        return read_file(request.file)
    simulated = load_one(request.base or DEFAULTS["machine"], kind="machine")["machine"]
    assert request.port is not None
    assert isinstance(simulated, Machine)
    return settings_text(parse_destination(request.port, request.baud), simulated)


def read_file(file: Path) -> ConfigText:
    """Read a configuration with the files that it includes. Raises ProfileError."""
    try:
        with file.open("rb") as stream:
            content = stream.read(MOST_BYTES + 1)
    except OSError as error:
        raise ProfileError(f"{file} cannot be read ({reason(error)})") from None
    wide = content.startswith((BOM_UTF16_LE, BOM_UTF16_BE))  # as PowerShell's > writes
    if len(content) > MOST_BYTES or (b"\0" in content and not wide):
        raise ProfileError(f"{file}: it is not a configuration: a text of less than {MOST_BYTES >> 20} MiB is expected")

    def beside(pattern: str) -> Sequence[ConfigText]:
        files = sorted(glob(pattern, root_dir=file.parent)) if has_magic(pattern) else [pattern]
        paths = [file.parent / other for other in files]
        return [read_file(path) for path in paths if has_magic(pattern) or path.is_file()]

    text = content.decode("utf-16" if wide else "utf-8-sig", "replace")
    return ConfigText(str(file), text.replace("\r\n", "\n").replace("\r", "\n"), beside)


def _lines(found: Found, proposal: Proposal, use: str) -> Iterator[str]:
    yield f"{found.firmware}: machine.dialect {found.dialect}, over the shipped {proposal.base}"
    yield f"  reported by the firmware: {len(proposal.values)}"
    for key, reading in proposal.values.items():
        yield f"    {_short(key)} = {value_text(reading.value)}  <- {reading.source}"
    if found.probe:
        yield f"    it has {found.probe}"
    if proposal.absent:
        yield f"  not reported, as in {proposal.base}: {len(proposal.absent)}"
        yield from (f"    {_short(key)}" for key in proposal.absent)
    yield f"  must be measured: {len(proposal.measured)}"
    yield from (f"    {_short(key)}" for key in proposal.measured)
    if CALIBRATED[0] in proposal.measured:
        yield f"  tiltprint calibrate --machine {use} measures the points, signs and zeros of the axes, a ruler the rest"
    yield f"  its G-code blocks are those of {proposal.base}: check machine.gcode.start before the first print"
    yield from (f"  note: {remark}" for remark in proposal.remarks)


def _short(key: str) -> str:
    return key.removeprefix("machine.")


def _as_json(found: Found, proposal: Proposal, out: Path) -> str:
    document = {
        "firmware": found.firmware,
        "dialect": found.dialect,
        "inherits": proposal.base,
        "file": str(out),
        "told": [{"key": key, "value": value.value, "source": value.source} for key, value in proposal.values.items()],
        "probe": found.probe,
        "not_told": list(proposal.absent),
        "only_measured": list(proposal.measured),
        "notes": [terminal_words(remark) for remark in proposal.remarks],
    }
    return json.dumps(document, indent=2, ensure_ascii=False) + "\n"
