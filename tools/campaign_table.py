"""The table of the print campaign: of every group how its runs ended, and each failure by its name and sentence."""

from collections import Counter
from collections.abc import Iterator, Sequence
from math import ceil
from statistics import median
from typing import Any

from tools.campaign_run import OUTCOMES, PRINTED
from tools.campaign_runs import VARIED

Record = dict[str, Any]


def table(records: Sequence[Record]) -> str:
    """The whole table as Markdown."""
    return "\n".join([*groups(records), "", *failures(records)])


def groups(records: Sequence[Record]) -> Iterator[str]:
    """One row a group, runs by default settings and varied ones apart."""
    columns = ("group", "runs", *OUTCOMES, "suspect", "core s median, p95, most", "MB median, p95, most")
    yield "| " + " | ".join(columns) + " |"
    yield "|---" * len(columns) + "|"
    by_group: dict[str, list[Record]] = {}
    for record in records:
        varied = ", varied" if record["name"].endswith(VARIED) else ""
        by_group.setdefault(record["group"] + varied, []).append(record)
    for group, own in [*sorted(by_group.items()), ("all", list(records))]:
        counts = Counter(record["outcome"] for record in own)
        share = f"{counts[PRINTED]} ({counts[PRINTED] / len(own):.1%})" if own else "0"
        others = [str(counts[outcome]) for outcome in OUTCOMES if outcome != PRINTED]
        suspect = sum(bool(record.get("suspect")) for record in own if record["outcome"] == PRINTED)
        spent = [spread([record[key] for record in own]) for key in ("core_s", "memory_mb")]
        yield "| " + " | ".join([group, str(len(own)), share, *others, str(suspect), *spent]) + " |"


def spread(values: Sequence[float]) -> str:
    """Median, 95th percentile and greatest."""
    if not values:
        return "-"
    rising = sorted(values)
    return f"{median(rising):.3g}, {rising[ceil(0.95 * len(rising)) - 1]:.3g}, {rising[-1]:.4g}"


def failures(records: Sequence[Record]) -> Iterator[str]:
    """Every run that did not print, or whose print our own look suspects, by outcome and name."""
    yield "| run | outcome | what is said | our own look | options |"
    yield "|---" * 5 + "|"
    order = {outcome: k for k, outcome in enumerate(reversed(OUTCOMES))}
    for record in sorted(records, key=lambda row: (order[row["outcome"]], row["name"])):
        if record["outcome"] != PRINTED or record.get("suspect"):
            findings = record.get("findings") or []
            said = "; ".join(f"{f['code']} (part {f['part']}, layer {f['layer']}): {f['message']}" for f in findings)
            cells = [record["name"], record["outcome"], said or record["sentence"] or "-"]
            cells += ["; ".join(record.get("suspect", [])) or "-", record["options"] or "-"]
            yield "| " + " | ".join(cell.replace("|", "/").replace("\n", " ") for cell in cells) + " |"
