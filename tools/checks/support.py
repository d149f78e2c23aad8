"""Area that needs support and gets none: `python tools/checks/support.py MODEL|FOLDER ... [--every N] [--machine NAME]`.

One row per model: parts, mm² seen from above that need support, mm² without it when each part is planned alone and when all parts
are planned together, the fraction of the latter, mm³ inside the outlines of support in both cases, core seconds of both, and why
each place gets none.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from time import process_time

from machine.pipeline.choice import pricing
from mdp.search.search import SearchRequest, decompose
from profiles.profile import Profile, load
from slicer.overhangs import find_overhangs
from slicer.sectioning import section_part
from slicer.support.from_earlier_part import plan_supports
from slicer.support.support import Supports, explain, own_supports
from tools.checks.harness import files, mesh_of, options_of, table

HEAD = ("model", "parts", "needs mm2", "own leaves", "plan leaves", "share", "support mm3", "planned", "s", "plan s", "why")


def main() -> None:
    """Read the options, print the table."""
    parser = options_of(__doc__)
    parser.add_argument("--machine", default="generic_ac")
    given = parser.parse_args()
    profile = load(machine=given.machine, settings=given.set)
    table(HEAD, files(given.models, given.every), lambda model: rows(model, profile))


def rows(model: Path, profile: Profile) -> Iterator[Sequence[object]]:
    """A model's cells."""
    parts = decompose(mesh_of(model, profile), model.name, profile, SearchRequest(price=pricing(profile))).parts
    began = process_time()
    sections = [section_part(part, profile, parts[:k], parts[k + 1 :]) for k, part in enumerate(parts)]
    own = [own_supports(layers, find_overhangs(layers)) for layers in sections]
    planning = process_time()
    planned = plan_supports(own)
    done = process_time()
    needs_mm2 = sum(area.area() for supports in own for area in supports.wanted)
    own_mm2, left_mm2 = (sum(supports.unsupported_mm2 for supports in several) for several in (own, planned))
    why = [
        f"part {part.index} layer {area.layer}: {area.mm2:.1f} mm2, {area.reason}"
        for part, supports in zip(parts, planned, strict=True)
        for area in explain(supports, supports.sections.heights.tip_mm)
    ]
    cells = [len(parts), f"{needs_mm2:.1f}", f"{own_mm2:.1f}", f"{left_mm2:.1f}", f"{left_mm2 / max(needs_mm2, 1e-9):.4f}"]
    cells += [f"{_mm3(several, profile):.0f}" for several in (own, planned)]
    yield [*cells, f"{planning - began:.2f}", f"{done - planning:.2f}", "; ".join(why)]


def _mm3(several: list[Supports], profile: Profile) -> float:
    """Volume inside the outlines of support, mm³, with layers of the usual height."""
    return profile.process.layer_height_mm * float(sum(area.area() for supports in several for area in supports.areas))


if __name__ == "__main__":
    main()
