"""How much of what needs support gets none, model by model, before and after support is handed down to earlier parts.

    python tools/check_support.py FOLDER_OR_FILE ... [--every N] [--machine NAME] [--set KEY=VALUE ...]

One row a model: parts, mm2 seen from above that need support, mm2 that the parts' own ground leaves without and that the plan of
all parts does, the share of the latter, mm3 inside the outlines of support both ways, core seconds of both, and why each place
gets none.
"""

import argparse
from pathlib import Path
from time import process_time

from compare_prints import files, mesh_of

from machine.pipeline.pricing import pricing
from mdp.search.search import SearchRequest, decompose
from profiles.errors import UserError
from profiles.profile import Profile, load
from slicer.overhangs import find_overhangs
from slicer.sectioning import section_part
from slicer.support.from_earlier_part import plan_supports
from slicer.support.support import Supports, explain, own_supports

HEAD = (
    "model",
    "parts",
    "needs mm2",
    "own ground leaves",
    "plan leaves",
    "share",
    "support mm3",
    "planned",
    "s",
    "plan s",
    "why",
)


def main() -> None:
    """Read the options, print the table."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("models", nargs="+", type=Path)
    options.add_argument("--every", type=int, default=1)
    options.add_argument("--machine", default="generic_ac")
    options.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    given = options.parse_args()
    profile = load(machine=given.machine, settings=given.set)
    print("| " + " | ".join(HEAD) + " |\n" + "|---" * len(HEAD) + "|")
    for file in files(given.models, given.every):
        print(row(file, profile), flush=True)


def row(file: Path, profile: Profile) -> str:
    """One model's line."""
    try:
        parts = decompose(mesh_of(file, profile), file.name, profile, SearchRequest(price=pricing(profile))).parts
        began = process_time()
        sections = [section_part(part, profile, parts[:k], parts[k + 1 :]) for k, part in enumerate(parts)]
        own = [own_supports(layers, find_overhangs(layers)) for layers in sections]
        planning = process_time()
        planned = plan_supports(own)
    except UserError as error:
        return f"| {file.name} | {error} |"
    needs_mm2 = sum(area.area() for supports in own for area in supports.wanted)
    left_mm2 = [sum(supports.unsupported_mm2 for supports in several) for several in (own, planned)]
    volumes = [_mm3(several, profile) for several in (own, planned)]
    why = [
        f"part {part.index} layer {area.layer}: {area.mm2:.1f} mm2, {area.reason}"
        for part, supports in zip(parts, planned, strict=True)
        for area in explain(supports, supports.sections.heights.tip_mm)
    ]
    cells = [file.name, len(parts), f"{needs_mm2:.1f}", *(f"{mm2:.1f}" for mm2 in left_mm2)]
    cells += [f"{left_mm2[1] / max(needs_mm2, 1e-9):.4f}", *(f"{mm3:.0f}" for mm3 in volumes)]
    cells += [f"{planning - began:.2f}", f"{process_time() - planning:.2f}", "; ".join(why)]
    return "| " + " | ".join(str(cell) for cell in cells) + " |"


def _mm3(several: list[Supports], profile: Profile) -> float:
    """Volume inside the outlines of support, by layers of the usual height."""
    return profile.process.layer_height_mm * float(sum(area.area() for supports in several for area in supports.areas))


if __name__ == "__main__":
    main()
