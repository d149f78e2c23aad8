"""Quick estimates compared with dry runs: `python tools/checks/estimates.py MODEL ... [--parts N] [--process NAME] [--set
KEY=VALUE ...]`.

One row per model, in one piece as it stands and, with `--parts`, in up to N parts: minutes and metres of filament of the dry run,
and the ratio of the estimate to each; cubic millimetres of support that the slicer prints, and the ratio of the estimate; core
seconds of the estimate, warm. Below the table: how many prints are within 4 %.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from time import process_time

from machine.pipeline.pipeline import build
from mdp.decomposition import Decomposition
from mdp.search.search import decompose
from profiles.profile import Profile, load
from slicer.estimate.estimate import estimate
from slicer.paths import Kind
from tools.checks.harness import files, mesh_of, options_of, table, undivided

NEAR = 0.04
HEAD = ("model", "parts", "min", "estimated", "filament m", "estimated", "support mm3", "estimated", "core s")


def main() -> None:
    """Read the options, print the table."""
    parser = options_of(__doc__)
    parser.add_argument("--parts", type=int, default=1, metavar="N")
    parser.add_argument("--process", default="standard", metavar="NAME")
    given = parser.parse_args()
    profile = load(process=given.process, settings=[f"search.most_parts={given.parts}", *given.set])
    ratios: list[tuple[float, float]] = []

    def rows(model: Path) -> Iterator[Sequence[object]]:
        mesh = mesh_of(model, profile)
        yield row(undivided(model.name, mesh, profile), profile, ratios)
        if given.parts > 1:
            yield row(decompose(mesh, model.name, profile), profile, ratios)

    table(HEAD, files(given.models, given.every), rows)
    time, filament = (sum(abs(pair[k] - 1.0) <= NEAR for pair in ratios) for k in range(2))
    print(f"\nwithin {NEAR:.0%}: {time} of {len(ratios)} in time, {filament} in filament")


def row(decomposition: Decomposition, profile: Profile, ratios: list[tuple[float, float]]) -> Sequence[object]:
    """A print's cells; appends the ratios of estimated to printed time and filament."""
    parts, program = decomposition.parts, build(decomposition, profile)
    estimate(parts, profile)
    began = process_time()
    quick = estimate(parts, profile)
    core_s = process_time() - began
    filament_mm = float(program.run.program.filament_mm.max())
    ratios.append((quick.time_s / program.run.time_s, quick.filament_mm / filament_mm))
    layers = [layer for part in program.sliced for layer in part.layers]
    support_mm3 = sum(layer.volumes_mm3[layer.is_of(Kind.SUPPORT, Kind.SUPPORT_INTERFACE)].sum() for layer in layers)
    cells = [len(parts), f"{program.run.time_s / 60:.1f}", f"{ratios[-1][0]:.3f}", f"{filament_mm / 1000:.2f}"]
    cells += [f"{ratios[-1][1]:.3f}", f"{support_mm3:.0f}"]
    return [*cells, f"{quick.support_mm3 / support_mm3:.2f}" if support_mm3 else "-", f"{core_s:.2f}"]


if __name__ == "__main__":
    main()
