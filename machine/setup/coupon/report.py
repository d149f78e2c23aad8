"""Report: what a coupon says, in words and as a Markdown table that others can compare with."""

from collections.abc import Sequence
from math import isnan

from machine.setup.coupon.bars import Shape
from machine.setup.coupon.fit import BY_CHANCE, Effect, Outcome
from machine.setup.coupon.sheet import Sheet, settings_in_words


def outcome_text(outcome: Outcome) -> str:
    """Strengths, effects and scatter for the terminal."""
    lines = [f"{name}: {mpa:.1f} MPa{share}" for name, mpa, share in _strengths(outcome)]
    lines += [f"{_setting(effect)}: {_verdict(effect)}" for effect in outcome.effects]
    lines.append(f"scatter: {100 * outcome.scatter:.1f} % of a bar's strength, from {outcome.loads} loads")
    return "\n".join(lines) + "\n"


def report_lines(sheet: Sheet, outcome: Outcome, version: str) -> list[str]:
    """The Markdown page: what was printed and broken how, strengths, effects, every bar."""
    lines = [f"# Joints: {sheet.material} on {sheet.machine}", ""]
    how = [
        ("machine", sheet.machine),
        ("material", sheet.material),
        ("process", sheet.process),
        ("bars", bars_in_words(sheet.shape)),
    ]
    how += [("loads", str(outcome.loads)), ("scatter", f"{100 * outcome.scatter:.1f} %"), ("tiltprint", version)]
    lines += _table(["what", "value"], how)
    lines += [
        "",
        *_table(
            ["strength", "MPa", "of one piece upright"], [(n, f"{m:.1f}", s.strip(" ,") or "") for n, m, s in _strengths(outcome)]
        ),
    ]
    effects = [(_setting(e), f"{100 * (e.ratio - 1.0):+.0f} %", _chance(e), _verdict(e)) for e in outcome.effects]
    lines += ["", *_table(["setting", "effect", "by chance", "so"], effects), ""]
    bars = []
    for bar, loads in enumerate(sheet.loads_n, start=1):
        known = [load for load in loads if not isnan(load)]
        strengths = ", ".join(f"{sheet.shape.strength_mpa(load):.1f}" for load in known)
        bars.append((str(bar), settings_in_words(sheet, bar), ", ".join(f"{load:g}" for load in known), strengths))
    return [*lines, *_table(["bar", "printed", "broke at N", "MPa"], bars)]


def bars_in_words(shape: Shape) -> str:
    """The section and how it is stressed."""
    section = f"{shape.depth_mm:g} x {shape.thickness_mm:g} mm"
    if shape.lever_mm > 0.0:
        return f"bent, {section}, {shape.lever_mm:g} mm from the joint: 6 F L / (b d^2), d = {shape.depth_mm:g} mm"
    return f"pulled, ISO 527-2 5A in outline, {section}: F / A"


def _strengths(outcome: Outcome) -> list[tuple[str, float, str]]:
    upright = outcome.upright_mpa

    def share(mpa: float) -> str:
        return f", {100 * mpa / upright:.0f} %" if upright else ""

    rows = [("joint as the process has it", outcome.joint_mpa, share(outcome.joint_mpa))]
    if outcome.won:
        rows.append(("joint with what won", outcome.best_joint_mpa, share(outcome.best_joint_mpa)))
    if upright is not None:
        rows.append(("in one piece, upright", upright, ""))
    if outcome.lying_mpa is not None:
        rows.append(("in one piece, lying", outcome.lying_mpa, share(outcome.lying_mpa)))
    return rows


def _chance(effect: Effect) -> str:
    return f"{effect.by_chance:.3f}" if effect.by_chance >= 0.001 else "< 0.001"


def _setting(effect: Effect) -> str:
    return f"{effect.factor.key} = {effect.factor.other} instead of {effect.factor.own}"


def _verdict(effect: Effect) -> str:
    change = f"{100 * abs(effect.ratio - 1.0):.0f} % {'stronger' if effect.ratio > 1.0 else 'weaker'}"
    if effect.told:
        return f"{change}, {effect.factor.other if effect.wins else effect.factor.own} is taken"
    least = f"{100 * (effect.least_ratio - 1.0):.0f} %"
    chance = f"{100 * (1 - BY_CHANCE):.0f} of 100 times scatter alone stays below {least}"
    return f"{change} is not told from scatter ({chance}): {effect.factor.own} stays"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    written = [[cell.replace("|", "\\|") for cell in row] for row in rows]
    return [f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *written)]
