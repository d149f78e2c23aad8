"""Problems of one table: what is found wrong is replaced by a sound value, so that the checks that come later see it too."""

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ValidationError

from profiles.frozen import KEY_BY_KEY
from profiles.wording import sentences


@dataclass(frozen=True)
class TableProblems:
    """Each problem one sentence.

    value: the table as its keys' own types have it, made without what they must be together; None for no table.
    mended: dotted keys whose values nobody gave, as those given are wrong.
    """

    problems: list[str]
    value: Any
    mended: frozenset[str]

    def tells_of_mended(self, sentence: str) -> bool:
        """Whether a sentence is of a value that nobody gave."""
        words = sentence.replace(":", " ").split()
        named = (f".{word}." for word in words)
        return any(f".{key}." in word or word == f".{key.rpartition('.')[2]}." for word in named for key in self.mended)


def table_problems(model: type[BaseModel], prefix: str, table: Any, sound: Mapping[str, Any]) -> TableProblems:
    """All problems of a table; its keys are dotted after the prefix.

    sound: the values of a profile that is fine.
    """
    given = deepcopy(table)
    wrong, mended, value = _rounds(model, prefix, given, sound, KEY_BY_KEY)
    single = TableProblems(wrong, value, mended)
    if value is not None:
        together, _, _ = _rounds(model, prefix, given, sound, None)
        wrong += [sentence for sentence in together if not single.tells_of_mended(sentence)]
    return TableProblems(wrong, value, mended)


def _rounds(
    model: type[BaseModel], prefix: str, given: Any, sound: Mapping[str, Any], context: str | None
) -> tuple[list[str], frozenset[str], Any]:
    """The problems, the keys mended in the table given, and what it is when it is sound; None where it cannot be mended."""
    problems: dict[str, None] = {}
    mended: set[tuple[str, ...]] = set()
    value = None
    while value is None:
        try:
            value = model.model_validate(given, context=context)
        except ValidationError as error:
            problems |= dict.fromkeys(sentences(error.errors(), model, prefix))
            key_paths = {_key_path(problem) for problem in error.errors()}
            if not isinstance(given, dict) or () in key_paths or key_paths <= mended:
                break
            for key_path in key_paths:
                _mend(given, key_path, sound)
            mended |= key_paths
    return list(problems), frozenset(prefix + ".".join(key_path) for key_path in mended), value


def _key_path(problem: Any) -> tuple[str, ...]:
    """Where to mend a problem: lists are replaced as a whole."""
    path: list[str] = []
    for step in problem["loc"]:
        if isinstance(step, int):
            break
        path.append(step)
    return tuple(path)


def _mend(given: dict[str, Any], key_path: tuple[str, ...], sound: Mapping[str, Any]) -> None:
    """Put the sound value where the wrong one stands, or take it out where there is none."""
    inner, value = given, sound
    for step in key_path[:-1]:
        if not isinstance(inner.get(step), dict):
            return
        inner, value = inner[step], value.get(step, {})
    if key_path[-1] in value:
        inner[key_path[-1]] = deepcopy(value[key_path[-1]])
    else:
        inner.pop(key_path[-1], None)
