"""Which way models lie: what is chosen, beside whole searches of the first ten ways in which each can rest.

    python tools/survey_sides.py FOLDER_OR_FILE ... [--every N] [--first K] [--most-faces N] [--set KEY=VALUE ...] --log FILE

One line of JSON a model is appended to FILE, models that it has are skipped: cost with time of every way to lie, as it stands
first, and of the way that is chosen; the order of the first of them by their forecast; processor seconds of one thread, of those
searches and of the choice. The last lines printed sum the file up, by the least cost that the rules of laying allow; models that
failed are named. --without leaves out models that other files name, such as those that rules were chosen on.
"""

import argparse
import json
from pathlib import Path
from statistics import mean, median
from time import process_time
from typing import Any

from compare_prints import files, mesh_of

from machine.app.pipeline.pricing import pricing
from mdp.decomposition import Decomposition
from mdp.directions.orientation import standing_still
from mdp.kernels.threads import use_threads
from mdp.mesh import Mesh
from mdp.search.front import Worth
from mdp.search.laying import CLEARLY, distinct_orientations, glimpses_of, lay_down, total_mm2
from mdp.search.search import decompose
from profiles.errors import UserError
from profiles.profile import Profile, load

WAYS = 10
SAME = 0.001  # of the cost: two ways that differ by less are as good as each other


def main() -> None:
    """Read the options, go through the models, sum up."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("models", nargs="+", type=Path)
    options.add_argument("--every", type=int, default=1)
    options.add_argument("--first", type=int, default=0, metavar="K", help="of every N models the K-th")
    options.add_argument("--most-faces", type=int, default=30_000, metavar="N")
    options.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    options.add_argument("--without", action="append", default=[], type=Path, metavar="FILE", help="a line of JSON a model")
    options.add_argument("--log", type=Path, required=True)
    given = options.parse_args()
    use_threads(1)
    profile = load(settings=given.set)
    rows = [json.loads(line) for line in given.log.read_text().splitlines()] if given.log.exists() else []
    known = {row["model"] for row in rows} | {name for other in given.without for name in _models(other)}
    for file in files(given.models, 1)[given.first :: given.every]:
        if file.name not in known:
            rows.append(survey(file, profile, given.most_faces))
            with given.log.open("a") as log:
                log.write(json.dumps(rows[-1]) + "\n")
    print("\n".join(summary(rows, profile)))


def _models(log: Path) -> list[str]:
    return [json.loads(line)["model"] for line in log.read_text().splitlines()]


def survey(file: Path, profile: Profile, most_faces: int) -> dict[str, Any]:
    """One model's figures."""
    worth, price = Worth.of(profile), pricing(profile)

    def search(mesh: Mesh) -> Decomposition:
        return decompose(mesh, file.name, profile, price=price)

    try:
        mesh = mesh_of(file, profile)
        if len(mesh.faces) > most_faces:
            return {"model": file.name, "error": f"{len(mesh.faces)} faces"}
        began = process_time()
        chosen = lay_down(mesh, profile, pricing, search).total_mm2
        row: dict[str, Any] = {"model": file.name, "faces": len(mesh.faces), "chosen": chosen, "choice_s": process_time() - began}
        looked_at = [glimpse.forecast_mm2 for glimpse in glimpses_of(mesh, profile, pricing)]
        row["order"] = sorted(range(len(looked_at)), key=looked_at.__getitem__)
        others = distinct_orientations(mesh, profile)[: WAYS - 1]
        began = process_time()
        ways = [mesh, *(standing_still(mesh, way.rotation) for way in others)]
        row["ways"] = [total_mm2(search(way).chosen, worth) for way in ways]
    except UserError as error:
        return {"model": file.name, "error": str(error)}
    return row | {"ways_s": process_time() - began}


def summary(rows: list[dict[str, Any]], profile: Profile) -> list[str]:
    """How much more the chosen ways cost than the least that may be chosen, and how many searches choosing takes."""
    known = [row for row in rows if "ways" in row]
    more = [row["chosen"] / least_mm2(row["ways"], profile) - 1.0 for row in known]
    searches = [row["choice_s"] / (row["ways_s"] / len(row["ways"])) for row in known]
    return [
        f"{len(known)} models, {sum(len(row['ways']) for row in known)} ways to lie",
        f"chosen over the best: mean {mean(more):+.4f}, within 1 %: {mean(value < 0.01 for value in more):.3f}, "
        f"over 5 %: {mean(value > 0.05 for value in more):.3f}",
        f"best way among the first two by forecast: {mean(_in_first_two(row) for row in known):.3f}",
        f"searches' time: mean {mean(searches):.2f}, median {median(searches):.2f}",
        *(f"{row['model']}: {value:+.3f}" for row, value in zip(known, more, strict=True) if value > 0.01),
        *(f"{row['model']}: {row['error']}" for row in rows if "error" in row),
    ]


def _in_first_two(row: dict[str, Any]) -> bool:
    return min(row["ways"][way] for way in row["order"][:2]) <= (1.0 + SAME) * min(row["ways"])


def least_mm2(ways: list[float], profile: Profile) -> float:
    """The least cost that may be chosen: as it stands, or a way that is clearly cheaper."""
    best = min(ways)
    return best if best < min(CLEARLY * ways[0], ways[0] - profile.search.turning_mm2) else ways[0]


if __name__ == "__main__":
    main()
