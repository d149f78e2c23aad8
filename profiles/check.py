"""Check: every problem of a profile file at once, each one sentence."""

from pathlib import Path

from profiles.errors import ProfileError
from profiles.places import OF_KIND, inherited, kind_in, merged, misspelt_parent, own_tables, parse, strangers, tables
from profiles.problems.of_table import table_problems
from profiles.profile import DEFAULTS, SECTIONS


def check_file(path: Path) -> list[str]:
    """All problems of a profile file, each one sentence; empty when it is fine."""
    try:
        kind, document = kind_in(path), parse(path)
    except ProfileError as error:
        return [str(error)]
    sound = tables(kind, DEFAULTS[kind])
    problem = strangers(kind, str(path), document)
    problems = [problem] if problem else []
    try:
        base = inherited(kind, str(path), document, (str(path.resolve()),))
    except ProfileError as error:
        problems.append(str(error))
        base = sound
    if misspelt_parent(document):  # what it would inherit is not missing
        base = sound
    whole = merged(base, own_tables(document))
    for section in OF_KIND[kind]:
        if section in whole:
            problems += table_problems(SECTIONS[section], f"{section}.", whole[section], sound.get(section, {})).problems
    return problems
