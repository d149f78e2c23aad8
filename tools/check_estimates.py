"""Compare quick estimates with dry runs.

    python tools/check_estimates.py MODEL [MODEL ...] [--parts N] [--process NAME] [--set KEY=VALUE ...]

One row a model, in one piece as it stands and, with --parts, as the search cuts it into up to N parts: minutes and metres of
filament of the dry run and the estimate over each; cubic millimetres of support that the slicer prints and the estimate over
them; seconds of one core that the estimate takes, once its kernels are compiled. Below the table: how many prints are within 4 %.
"""

import argparse
from time import process_time

from machine.pipeline.pipeline import build
from mdp.decomposition import Decomposition
from mdp.mesh import Mesh
from mdp.model_file import locate
from mdp.read import read_mesh
from mdp.search.parts import one_piece
from mdp.search.search import decompose
from profiles.errors import UserError
from profiles.profile import Profile, load
from slicer.estimate.estimate import estimate
from slicer.paths import Kind

NEAR = 0.04
HEAD = "model", "parts", "min", "estimated", "filament m", "estimated", "support mm3", "estimated", "core s"


def main() -> None:
    """Read the options, print the table."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("models", nargs="+", metavar="MODEL")
    options.add_argument("--parts", type=int, default=1, metavar="N")
    options.add_argument("--process", default="standard", metavar="NAME")
    options.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    given = options.parse_args()
    profile = load(process=given.process, settings=[f"search.most_parts={given.parts}", *given.set])
    print("| " + " | ".join(HEAD) + " |\n" + "|---" * len(HEAD) + "|")
    ratios: list[tuple[float, float]] = []
    for model in given.models:
        mesh, _ = read_mesh(locate(model), profile.process.scale, profile.process.rotate_deg)
        name = model.rsplit("/", 1)[-1]
        choices = [in_one_piece(mesh, name, profile)]
        if given.parts > 1:
            choices.append(decompose(mesh, name, profile))
        for decomposition in choices:
            print(row(decomposition, profile, ratios), flush=True)
    time, filament = (sum(abs(pair[k] - 1.0) <= NEAR for pair in ratios) for k in range(2))
    print(f"\nwithin {NEAR:.0%}: {time} of {len(ratios)} in time, {filament} in filament")


def in_one_piece(mesh: Mesh, name: str, profile: Profile) -> Decomposition:
    """The model as it stands."""
    return Decomposition(name, mesh, (one_piece(mesh, profile.machine),), 1, "classic", 0.0, 0.0, 0, 0, 0.0)


def row(decomposition: Decomposition, profile: Profile, ratios: list[tuple[float, float]]) -> str:
    """One line of the table; time and filament of the estimate over those of the print are added to the ratios."""
    parts = decomposition.parts
    cells: list[object] = [decomposition.name, len(parts)]
    try:
        program = build(decomposition, profile)
    except UserError as error:
        return "| " + " | ".join(map(str, [*cells, f"refused: {error}"])) + " |"
    estimate(parts, profile)
    began = process_time()
    quick = estimate(parts, profile)
    core_s = process_time() - began
    filament_mm = float(program.run.program.filament_mm.max())
    ratios.append((quick.time_s / program.run.time_s, quick.filament_mm / filament_mm))
    layers = [layer for part in program.sliced for layer in part.layers]
    support_mm3 = sum(layer.volumes_mm3[layer.is_of(Kind.SUPPORT, Kind.SUPPORT_INTERFACE)].sum() for layer in layers)
    cells += [f"{program.run.time_s / 60:.1f}", f"{ratios[-1][0]:.3f}"]
    cells += [f"{filament_mm / 1000:.2f}", f"{ratios[-1][1]:.3f}"]
    cells += [f"{support_mm3:.0f}", f"{quick.support_mm3 / support_mm3:.2f}" if support_mm3 else "-", f"{core_s:.2f}"]
    return "| " + " | ".join(map(str, cells)) + " |"


if __name__ == "__main__":
    main()
