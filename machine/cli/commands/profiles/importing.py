"""The profiles import command: imports another slicer's configuration as a material and a process of the user's own."""

import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from machine.cli.terminal.requests import ImportRequest
from machine.notices import plain_lines, say
from machine.pipeline.output import check_folder, plain_name, refuse_to_overwrite, write_own
from machine.pipeline.profile_file import profile_text
from profiles.errors import ProfileError
from profiles.foreign.config import Config
from profiles.foreign.imported import KINDS, Imported, Row, imported, unchanged_keys, unused
from profiles.foreign.read import read_config
from profiles.places import own_folder

LONGEST_TEXT = 40  # longest imported value in the table
WIDTH = 100
AS_IT_IS, WORKED_OUT, LEFT = "taken as it is", "computed", "left"


def import_profiles(request: ImportRequest) -> int:
    """Write the material and the process of a file, and report for each setting whether and how it was imported."""
    presets = {"process": request.process, "material": request.material, "printer": request.printer}
    if request.out is not None:
        check_folder(request.out)
    config = read_config(request.file, presets)
    for kind, name in (("process", config.process), ("material", config.material)):
        if presets[kind] not in ("", name):
            raise ProfileError(f"--{kind}-preset {presets[kind]}: {request.file} is not a bundle with presets to choose from")
    found = [imported(config, kind, request.name, request.file.stem) for kind in KINDS]
    rows = [row for profile in found for row in profile.rows]
    if not rows:
        raise ProfileError(f"profile {request.file}: none of its {len(config.entries)} settings has an equivalent here")
    found = [profile for profile in found if any(row.taken for row in profile.rows)]
    if not found:
        raise ProfileError(
            f"profile {request.file}: {len(rows)} of its {len(config.entries)} settings have an equivalent here, but no value of "
            f"theirs can be taken, the first: {_row(rows[0])}"
        )
    files = {profile.kind: _file(request, profile) for profile in found}
    for file in files.values():
        refuse_to_overwrite(file, request.replace)
    texts = {profile.kind: profile_text(profile.kind, profile.base, profile.settings) for profile in found}
    for kind, file in files.items():
        write_own(file, texts[kind], request.replace)
    sys.stdout.write(_as_json(config, found, files) if request.json else plain_lines(_table(config, found)) + "\n")
    for kind, file in files.items():
        say(f"saved: {file}; use it as --{kind} {file.stem if request.out is None else file}")
    return 0


def _file(request: ImportRequest, profile: Imported) -> Path:
    """File for a profile, with a valid name, in the requested folder or the user's own."""
    stem = plain_name(profile.name).strip("._") or profile.kind
    if request.out is None:
        return own_folder(profile.kind) / f"{stem}.toml"
    return request.out / f"{stem}-{profile.kind}.toml"


def _table(config: Config, found: Sequence[Imported]) -> str:
    return "\n".join(_lines(config, found))


def _lines(config: Config, found: Sequence[Imported]) -> Iterator[str]:
    for profile in found:
        yield f"{profile.kind} {profile.name!r}, from {config.program}, over the shipped {profile.base}"
        for title, rows in _groups(profile.rows).items():
            yield f"  {title}: {len(rows)}"
            yield from (f"    {_row(row)}" for row in rows)
        ours = [key.split(".", 1)[1] for key in unchanged_keys(profile)]
        yield from _listed(f"  stay as {profile.base} has them: {len(ours)}", ours)
        yield ""
    others = unused(config)
    yield from _listed(f"settings without an equivalent here, or that belong to the machine: {len(others)}", others)


def _groups(rows: Sequence[Row]) -> dict[str, list[Row]]:
    groups: dict[str, list[Row]] = {AS_IT_IS: [], WORKED_OUT: [], LEFT: []}
    for row in rows:
        groups[LEFT if not row.taken else WORKED_OUT if row.how else AS_IT_IS].append(row)
    return {title: some for title, some in groups.items() if some}


def _row(row: Row) -> str:
    text = row.text if len(row.text) <= LONGEST_TEXT else f"{row.text[:LONGEST_TEXT]}..."
    theirs = f"{row.name} = {text}"
    if not row.taken:
        return f"{theirs}: {row.how}"
    return f"{row.key.split('.', 1)[1]} = {row.value}  <- {theirs}" + (f"  ({row.how})" if row.how else "")


def _listed(title: str, names: Sequence[str]) -> Iterator[str]:
    """A title and the names below it, with as many to a line as fit."""
    yield title
    line = ""
    for name in names:
        if line and len(line) + len(name) + 2 > WIDTH:
            yield f"    {line},"
            line = ""
        line = f"{line}, {name}" if line else name
    if line:
        yield f"    {line}"


def _as_json(config: Config, found: Sequence[Imported], files: dict[str, Path]) -> str:
    document = {
        "program": config.program,
        "profiles": [
            {
                "kind": profile.kind,
                "name": profile.name,
                "inherits": profile.base,
                "file": str(files[profile.kind]),
                "settings": [
                    {"theirs": row.name, "text": row.text, "key": row.key, "value": row.value, "note": row.how}
                    for row in profile.rows
                ],
                "stay": unchanged_keys(profile),
            }
            for profile in found
        ],
        "unused": unused(config),
    }
    return json.dumps(document, indent=2, ensure_ascii=False) + "\n"
