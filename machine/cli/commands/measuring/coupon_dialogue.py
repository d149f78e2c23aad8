"""Coupon talk: a person with the broken bars is asked for their loads one by one, each number judged at once."""

import sys
from collections.abc import Callable
from dataclasses import replace

from machine.cli.commands.measuring.calibrate_dialogue import read_reply
from machine.notices import plain_line
from machine.setup.coupon.sheet import Sheet, load_problem, settings_in_words

N_PER_KG = 9.80665
INTRO = """{bars} bars of a {shape} coupon, printed on {machine}: at what load did each break?
Newtons, or as a scale shows it: 9.2kg. The plate printed more than once: one load for each time, in one line.
Enter keeps what stands in [ ], s skips a bar, b goes back, Ctrl-C ends and leaves all as it was.
"""


def ask_loads(sheet: Sheet, judge: Callable[[Sheet], str]) -> Sheet:
    """The sheet with the loads that a person types. judge: why they do not do, then they are asked again; "": they do.

    Raises ProfileError at the end of input.
    """
    bars = len(sheet.loads_n)
    sys.stdout.write(INTRO.format(bars=bars, shape=sheet.shape.name, machine=plain_line(sheet.machine)))
    loads: list[tuple[float, ...]] = [()] * bars
    bar = 0
    while True:
        while bar < bars:
            bar = _ask(sheet, bar, loads)
        complete = replace(sheet, loads_n=tuple(loads))
        problem = judge(complete)
        if not problem:
            return complete
        sys.stdout.write(f"{problem}\n")
        bar = 0


def _ask(sheet: Sheet, bar: int, loads: list[tuple[float, ...]]) -> int:
    """Ask until a bar has its answer; the bar to be asked next."""
    usual = f" [{' '.join(f'{load:g}' for load in loads[bar])}]" if loads[bar] else ""
    while True:
        reply = read_reply(f"bar {bar + 1}, {settings_in_words(sheet, bar + 1)}, N{usual}: ", "all loads were told")
        if reply == "b":
            return max(0, bar - 1)
        if reply == "s" or (not reply and loads[bar]):
            loads[bar] = () if reply else loads[bar]
            return bar + 1
        numbers = _numbers(reply)
        problem = "" if numbers is None else next(filter(None, map(sheet_problem(sheet), numbers)), "")
        if numbers is not None and not problem:
            loads[bar] = tuple(numbers)
            return bar + 1
        sys.stdout.write(f"  {problem or f'{reply!r} cannot be read: a number such as 85 or 9.2kg is expected'}\n")


def sheet_problem(sheet: Sheet) -> Callable[[float], str]:
    """What is said of a load of this sheet's bars; "": nothing."""
    return lambda load_n: load_problem(sheet.shape, load_n)


def _numbers(reply: str) -> list[float] | None:
    """The loads of a line in N; None where it holds something else."""
    try:
        words = reply.replace(" kg", "kg").replace(" n", "n").split()
        numbers = [float(word[:-2]) * N_PER_KG if word.endswith("kg") else float(word.removesuffix("n")) for word in words]
    except ValueError:
        return None
    return numbers or None
