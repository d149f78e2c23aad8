"""Check: every problem of a profile file at once, each one sentence."""

from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from profiles.errors import ProfileError
from profiles.places import OF_KIND, inherited, kind_in, merged, misspelt_parent, own_tables, parse, strangers, tables
from profiles.profile import DEFAULTS, SECTIONS
from profiles.wording import sentences

MOST_ROUNDS = 100


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
            problems += table_problems(SECTIONS[section], f"{section}.", whole[section], sound.get(section, {}))
    return problems


def table_problems(model: type[BaseModel], prefix: str, table: Any, sound: Mapping[str, Any]) -> list[str]:
    """All problems of a table: what is found wrong is replaced by a sound value, so that the checks that come later see it too.

    sound: the values of a profile that is fine.
    """
    problems: dict[str, None] = {}
    given = deepcopy(table)
    for _ in range(MOST_ROUNDS):
        try:
            model.model_validate(given)
        except ValidationError as error:
            problems |= dict.fromkeys(sentences(error.errors(), model, prefix))
            places = [_place(problem) for problem in error.errors()]
            if not isinstance(given, dict) or () in places:
                break
            for place in places:
                _mend(given, place, sound)
        else:
            break
    return list(problems)


def _place(problem: Any) -> tuple[str, ...]:
    """Where to mend a problem: lists are replaced as a whole."""
    place: list[str] = []
    for step in problem["loc"]:
        if isinstance(step, int):
            break
        place.append(step)
    return tuple(place)


def _mend(given: dict[str, Any], place: tuple[str, ...], sound: Mapping[str, Any]) -> None:
    """Put the sound value where the wrong one stands, or take it out where there is none."""
    inner, value = given, sound
    for step in place[:-1]:
        if not isinstance(inner.get(step), dict):
            return
        inner, value = inner[step], value.get(step, {})
    if place[-1] in value:
        inner[place[-1]] = deepcopy(value[place[-1]])
    else:
        inner.pop(place[-1], None)
