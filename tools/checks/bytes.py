"""Compare the program's output byte for byte with that of an earlier commit.

    python tools/checks/bytes.py MODEL ... [--machine NAME ...] [--set KEY=VALUE ...] -o BYTES.json
    python tools/checks/bytes.py MODEL ... [--machine NAME ...] [--set KEY=VALUE ...] --against BYTES.json

MODEL is a file or demo:NAME. For every model and machine: the G-code, the plan, the figures of the dry run and the record of the
search (for the first machine only), each as a SHA-256. `--against` names every difference and exits with 1 if there is one; a
refusal counts by its sentence. Rows that BYTES.json lacks are left out. Search times are not compared.
"""

import sys
from collections.abc import Iterator
from hashlib import sha256
from json import dumps, loads
from pathlib import Path
from tempfile import TemporaryDirectory

from machine.dryrun.dryrun import summary
from machine.pipeline.pipeline import build, decompose_model
from machine.pipeline.requests import ModelRequest, Outputs
from mdp.search.plan_writing import plan_text
from profiles.errors import UserError
from profiles.profile import load
from tools.checks.harness import options_of

MACHINES = ("generic_ac", "fractal5pro", "open5x_jubilee")


def main() -> int:
    """Read the options, write the sums or compare them."""
    parser = options_of(__doc__)
    parser.add_argument("--machine", nargs="+", default=MACHINES)
    parser.add_argument("-o", dest="output", type=Path)
    parser.add_argument("--against", type=Path)
    given = parser.parse_args()
    before = {} if given.against is None else loads(given.against.read_text(encoding="utf-8"))
    sums: dict[str, dict[str, str]] = {}
    different = 0
    for model in given.models:  # by the given names, which plans contain
        for number, machine in enumerate(given.machine):
            row = f"{Path(model).name} {machine}"
            if given.against is not None and row not in before:
                continue
            sums[row] = dict(written(model, machine, given.set, number == 0))
            wrong = [name for name, value in sums[row].items() if before.get(row, sums[row]).get(name) != value]
            different += len(wrong)
            print(row, "differs: " + ", ".join(wrong) if wrong else "", flush=True)
            if given.output is not None:
                given.output.write_text(dumps(sums, indent=1), encoding="utf-8")
    print(f"{len(sums)} prints, {different} differences")
    return 1 if different else 0


def written(model: str, machine: str, settings: list[str], record: bool) -> Iterator[tuple[str, str]]:
    """Name and sum of each output of a print."""
    profile = load(machine=machine, settings=settings)
    with TemporaryDirectory() as folder:
        file = Path(folder) / "record"
        request = ModelRequest(model, profile, outputs=Outputs(record=file if record else None))
        try:
            decomposed = decompose_model(request, to_build=True)
            yield "plan", _sum(plan_text(decomposed.plan).encode())
            if record:
                yield "record", _sum(file.read_bytes())
            program = build(decomposed.decomposition, decomposed.profile, pictures=True)
        except UserError as error:
            yield "refusal", str(error)
            return
        yield "gcode", _sum("\n".join(program.lines).encode())
        yield "figures", _sum(dumps(summary(program.run), sort_keys=True).encode())


def _sum(content: bytes) -> str:
    return sha256(content).hexdigest()


if __name__ == "__main__":
    sys.exit(main())
