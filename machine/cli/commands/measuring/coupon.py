"""The coupon command: prints test bars, evaluates the loads at which they broke, and saves the result."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import date
from importlib.metadata import version
from pathlib import Path
from typing import Any

from machine.cli.commands.measuring.questionnaire import Question, ask
from machine.cli.terminal.report import print_table
from machine.cli.terminal.requests import CouponRequest
from machine.notices import plain_line, say, show
from machine.pipeline.output import check_outputs, check_writable, refuse_to_overwrite, write_bytes, write_lines, write_own
from machine.pipeline.pictures import contact_sheet, write_png
from machine.pipeline.pipeline import build
from machine.pipeline.programs import refuse_errors
from machine.pipeline.requests import STDOUT, Outputs
from machine.setup.coupon.bars import SHAPES, Shape
from machine.setup.coupon.design import (
    Sheet,
    empty_sheet,
    factors,
    load_problem,
    read_sheet,
    settings_in_words,
    settings_of_bars,
    sheet_text,
)
from machine.setup.coupon.fit import Outcome, evaluate, material_tables, outcome_text, process_tables, report_lines
from machine.setup.coupon.plate import coupon
from machine.setup.files import own_profile
from machine.view.page import print_page
from profiles.errors import OutputError, ProfileError
from profiles.part_settings import PartSettings
from profiles.places import KINDS
from profiles.profile import Profile, load, with_part_settings

N_PER_KG = 9.80665
INTRO = """{bars} bars of a {shape} coupon, printed on {machine}: at what load did each break?
Newtons, or as a scale shows it: 9.2kg. The plate printed more than once: one load for each time, in one line.
Enter keeps the value in [ ], s skips a bar, b goes back, Ctrl-C ends without changes.
"""
UNSUPPORTED = ("process.support=none",)  # the bars need none, and it would stand on the joints to be measured


def write_program(request: CouponRequest, out: Path) -> int:
    """Write the G-code, the sheet to fill in beside it, and the requested pictures."""
    sheet_file = out.with_suffix(".toml")
    if sheet_file == out:
        raise OutputError(f"-o {out}: the sheet is written there, beside the program: another ending is expected, such as .gcode")
    for file in (out, sheet_file):
        check_writable(file)
        refuse_to_overwrite(file, request.replace)
    check_outputs(Outputs(html=request.html, png=request.png))
    shape = _shape(request)
    profile = load(*request.given.names, settings=(*request.given.settings, *UNSUPPORTED))
    chosen = factors(profile, request.vary)
    decomposition = coupon(shape, profile)
    profile = _with_settings_of_bars(profile, settings_of_bars(chosen))
    program = build(decomposition, profile, pictures=True)
    refuse_errors(program.run.errors, request.force)
    write_lines(out, program.lines)
    write_bytes(sheet_file, sheet_text(empty_sheet(shape, request.given.names, chosen)).encode())
    if request.html is not None:
        write_bytes(request.html, print_page(decomposition.name, program, profile))
    if request.png is not None:
        write_png(request.png, contact_sheet(decomposition, profile.machine))
    show(print_table(program, profile))
    named = " ".join(f"--{kind} {name}" for kind, name in zip(KINDS, request.given.names, strict=True))
    show(f"print {out}, break the bars, note the loads in {sheet_file}\nthen: tiltprint coupon {named} --measured {sheet_file}\n")
    return 0


def evaluate_sheet(request: CouponRequest, measured: Path) -> int:
    """Evaluate a filled sheet: save strengths and best settings, or only write a report."""
    sheet = read_sheet(measured)
    for kind, made_for, name in zip(KINDS, (sheet.machine, sheet.material, sheet.process), request.given.names, strict=True):
        if made_for != name:
            raise ProfileError(f"{measured} is a sheet of {made_for}: --{kind} {made_for} is expected, not {name}")
    outcome = evaluate(sheet)
    if request.report is not None:
        if request.report != STDOUT:
            check_writable(request.report)
            refuse_to_overwrite(request.report, request.replace)
        write_lines(request.report, report_lines(sheet, outcome, version("tiltprint")))
        if request.report != STDOUT:
            say(f"wrote {request.report}")
        return 0
    show(outcome_text(outcome))
    _save(request, outcome)
    return 0


def ask_for_loads(request: CouponRequest) -> int:
    """Ask for the loads one by one, show the result and save it."""
    profile = load(*request.given.names, settings=request.given.settings)
    sheet = empty_sheet(_shape(request), request.given.names, factors(profile, request.vary))
    for kind in ("material", "process"):
        refuse_to_overwrite(_own_profile(request, kind, {})[0], request.replace)

    outcome = evaluate(_ask_loads(sheet))
    show(outcome_text(outcome))
    _save(request, outcome)
    return 0


def _ask_loads(sheet: Sheet) -> Sheet:
    """The sheet with valid loads that the user enters."""
    bars = len(sheet.loads_n)
    sys.stdout.write(INTRO.format(bars=bars, shape=sheet.shape.name, machine=plain_line(sheet.machine)))

    def question(bar: int) -> Question[tuple[float, ...]]:
        text = f"bar {bar}, {settings_in_words(sheet, bar)}, N"
        return Question(text, lambda reply: _loads(reply, sheet.shape), lambda loads: " ".join(f"{n:g}" for n in loads), ())

    def judge(loads: list[tuple[float, ...]]) -> str:
        try:
            evaluate(replace(sheet, loads_n=tuple(loads)))
        except ProfileError as error:  # ask again
            return str(error)
        return ""

    return replace(sheet, loads_n=tuple(ask([question(bar) for bar in range(1, bars + 1)], "all loads were given", judge)))


def _loads(reply: str, shape: Shape) -> tuple[float, ...]:
    """Parse the loads of a line, N. Raises ProfileError."""
    try:
        words = reply.replace(" kg", "kg").replace(" n", "n").split()
        loads = [float(word[:-2]) * N_PER_KG if word.endswith("kg") else float(word.removesuffix("n")) for word in words]
    except ValueError:
        loads = []
    if not loads:
        raise ProfileError(f"{reply!r} cannot be read: a number such as 85 or 9.2kg is expected")
    if problem := next(filter(None, (load_problem(shape, load_n) for load_n in loads)), ""):
        raise ProfileError(problem)
    return tuple(loads)


def _save(request: CouponRequest, outcome: Outcome) -> None:
    """Save strengths and best settings in the user's own profiles; backups of the previous files stay beside them."""
    day = date.today()
    before = load(*request.given.names, settings=request.given.settings).material
    found = {"material": material_tables(outcome, before, day), "process": process_tables(outcome, day)}
    profiles = {kind: _own_profile(request, kind, tables) for kind, tables in found.items() if tables}
    for file, _ in profiles.values():
        refuse_to_overwrite(file, request.replace)
    for kind, (file, text) in profiles.items():
        write_own(file, text, request.replace)
        show(f"saved: {file}; use it as --{kind} {file.stem}\n")
    if "process" not in profiles:
        show("no setting is better than the process's own: it stays as it is\n")


def _own_profile(request: CouponRequest, kind: str, tables: Mapping[str, Any]) -> tuple[Path, str]:
    name = dict(zip(KINDS, request.given.names, strict=True))[kind]
    return own_profile(kind, request.save or Path(name).stem, name, tables)


def _shape(request: CouponRequest) -> Shape:
    if request.shape not in SHAPES:
        raise ProfileError(f"--shape {request.shape}: {' or '.join(SHAPES)} is expected")
    return SHAPES[request.shape]


def _with_settings_of_bars(profile: Profile, settings: Sequence[dict[str, Any]]) -> Profile:
    given = [PartSettings(part=bar + 1, process=own) for bar, own in enumerate(settings, start=1) if own]
    return with_part_settings(profile, given)
