"""How many parts the program chooses over many models, what they are estimated to save, and the published search beside it.

    python tools/survey_parts.py FOLDER_OR_FILE ... [--every N] [--set KEY=VALUE ...] [--published] --log FILE

One line of JSON a model is appended to FILE, models that it has are skipped: parts, area that needs support, seams, cost, the
largest share of a cut's rim that is a feather edge, the estimated time and filament over those of one piece straight up,
processor seconds. --published: also the parts and the area that --search published leaves, and the fewest parts that our search
needs for that area on the same terms. The last lines printed sum the file up; models that failed are named.
"""

import argparse
import json
from pathlib import Path
from statistics import mean, median
from time import process_time
from typing import Any

from compare_prints import files, mesh_of

from machine.pipeline.choice import pricing
from mdp.decomposition import Decomposition
from mdp.search.search import SearchRequest, decompose
from profiles.errors import UserError
from profiles.profile import Profile, load


def main() -> None:
    """Read the options, go through the models, sum up."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("models", nargs="+", type=Path)
    options.add_argument("--every", type=int, default=1)
    options.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    options.add_argument("--published", action="store_true")
    options.add_argument("--log", type=Path, required=True)
    given = options.parse_args()
    profile = load(settings=given.set)
    terms = {name: load(settings=[*given.set, setting]) for name, setting in RIVALS.items()} if given.published else {}
    rows = [json.loads(line) for line in given.log.read_text().splitlines()] if given.log.exists() else []
    for file in files(given.models, given.every):
        if all(row["model"] != file.name for row in rows):
            rows.append(survey(file, profile, terms))
            with given.log.open("a") as log:
                log.write(json.dumps(rows[-1]) + "\n")
    print("\n".join(summary(rows)))


RIVALS = {"published": "search.method=published", "risky": "search.objective=risky"}


def survey(file: Path, profile: Profile, terms: dict[str, Profile]) -> dict[str, Any]:
    """One model's figures."""
    try:
        mesh = mesh_of(file, profile)
        began = process_time()
        ours = decompose(mesh, file.name, profile, SearchRequest(price=pricing(profile)))
        row = {"model": file.name, "faces": len(mesh.faces), "core_s": process_time() - began, **figures(ours)}
        rivals = {name: decompose(mesh, file.name, rival) for name, rival in terms.items()}
    except UserError as error:
        return {"model": file.name, "error": str(error)}
    if rivals:
        published, front = rivals["published"], rivals["risky"].front
        left_mm2 = published.residual_area_mm2
        enough = [plan.parts for plan in front if plan.support_area_mm2 <= left_mm2 * (1.0 + 1e-6)]
        row |= {"published_parts": len(published.parts), "published_mm2": left_mm2, "parts_for_it": min(enough, default=None)}
    return row


def figures(decomposition: Decomposition) -> dict[str, Any]:
    """The chosen row, beside that of one piece."""
    whole, chosen = decomposition.front[0], decomposition.chosen
    assert chosen is not None  # a search always chooses
    timed = chosen.time_s and whole.time_s and chosen.filament_mm and whole.filament_mm
    return {
        "parts": chosen.parts,
        "support_mm2": chosen.support_area_mm2,
        "support_whole_mm2": whole.support_area_mm2,
        "seam_mm": chosen.seam_mm,
        "cost_mm2": chosen.cost_mm2,
        "feather_share": max(part.feather_share for part in decomposition.parts),
        "time": chosen.time_s / whole.time_s if timed else None,
        "filament": chosen.filament_mm / whole.filament_mm if timed else None,
    }


def summary(rows: list[dict[str, Any]]) -> list[str]:
    """What the rows come to."""
    good, failed = [row for row in rows if "error" not in row], [row for row in rows if "error" in row]
    cut = [row for row in good if row["parts"] > 1]
    timed = [row for row in cut if row["time"] is not None]
    lines = [f"{row['model']}: {row['error']}" for row in failed]
    lines += [
        f"{row['model']}: {row['feather_share']:.0%} of a rim is a feather edge" for row in good if row["feather_share"] > 0.1
    ]
    lines.append(f"{len(good)} models, mean parts {mean(row['parts'] for row in good):.2f}, {len(cut)} cut")
    if timed:
        for what in ("time", "filament"):
            ratios = [row[what] for row in timed]
            dear = sum(ratio > 1.05 for ratio in ratios)
            dearest = f"{dear} of {len(ratios)} above 1.05, most {max(ratios):.2f}"
            lines.append(f"estimated {what} where cut: median {median(ratios):.3f}, {dearest}")
    if rivals := [row for row in good if "published_parts" in row]:
        within = sum(row["parts_for_it"] is not None and row["parts_for_it"] <= row["published_parts"] for row in rivals)
        lines.append(f"at the published area no more parts than published: {within} of {len(rivals)}")
    return lines


if __name__ == "__main__":
    main()
