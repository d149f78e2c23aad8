"""Wording: the allowed values of a key, and one sentence for each problem found by pydantic."""

import json
import re
from collections.abc import Collection, Iterator
from difflib import get_close_matches
from enum import Enum
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from profiles.frozen import share_of, unit_of
from profiles.messages import key_name, phrase

LONGEST_VALUE = 60
KEY = re.compile(r"\b[a-z][a-z0-9]*_\w+")
ONE_OF, NAME_OF = re.compile(r"\^\[(\w+)\]\$"), re.compile(r"\^\[([^\]]+)\]\*\$")
DECIMAL_COMMA = re.compile(r"-?\d+,\d+")
KINDS = (("A-Za-z", "letters"), ("0-9", "digits"))


def sentences(problems: list[Any], root: type[BaseModel], prefix: str = "") -> list[str]:
    """One sentence for each problem of a ValidationError: key, value, allowed values; keys are dotted after the prefix."""
    unique = dict.fromkeys(sentence for problem in problems for sentence in _sentences(problem, root, prefix))
    return list(unique)


def allowed(field: FieldInfo) -> str:
    """The allowed values of a field in words: "a number from 0.02 to 2"."""
    return _allowed(field.annotation, field.metadata)


def keys(model: type[BaseModel], prefix: str) -> Iterator[tuple[str, FieldInfo]]:
    """Every dotted key of a model with its field, including nested tables."""
    for name, field in model.model_fields.items():
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            yield from keys(field.annotation, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", field


def _sentences(problem: Any, root: type[BaseModel], prefix: str) -> Iterator[str]:
    """The sentences of one problem: the check of a table may report several, one per line."""
    for text in problem["msg"].removeprefix("Value error, ").splitlines():
        yield _sentence(problem, text, root, prefix)


def _sentence(problem: Any, text: str, root: type[BaseModel], prefix: str) -> str:
    steps = tuple(problem["loc"])
    key = (prefix + ".".join(str(step) for step in steps)).rstrip(".")
    if problem["type"] == "value_error":
        table = _table(root, steps)
        fields = () if table is None else table.model_fields
        word = text.split(" ")[0].rstrip(":")
        if not key:
            return text
        if word.split(".")[0] in fields:
            return f"{key_name(f'{key}.{word}')}{_with_marks(text[len(word) :], key, fields)}"
        return f"{key_name(key)}: {_with_marks(text, key, fields)}"
    if problem["type"] == "extra_forbidden":
        near = nearest(key, [name for name, _ in sorted(keys(root, prefix), key=_rareness)])
        return f"{key} is not a key of a profile" + (
            f": did you mean {key_name(near)}?" if near else f" ({phrase('settings', '`profiles show`')} lists them)"
        )
    if problem["type"] == "missing" and not isinstance(steps[-1], int):
        field = _field(root, steps)
        return f"{key_name(key)} is missing" + (f": {allowed(field)} is expected" if field else "")
    field = _field(root, steps)
    while steps and isinstance(steps[-1], int) and problem["type"] == "missing":
        steps, key = steps[:-1], key.rpartition(".")[0]
    if field and unit_of(key) == "%":
        return f"{key_name(key)} is {_share_problem(problem['input'], field)}"
    expected = allowed(field) if field else "a table of keys"
    return f"{key_name(key)} is {_shown(problem['input'])}: it must be {expected}{decimal_hint(problem['input'])}"


def decimal_hint(given: Any) -> str:
    """Hint to write a number with a decimal point instead of a comma; "" for any other value."""
    text = given.strip() if isinstance(given, str) else ""
    return f": write {text.replace(',', '.')}" if DECIMAL_COMMA.fullmatch(text) else ""


def _share_problem(given: Any, field: FieldInfo) -> str:
    """The value of a share and what it must be: a number for a file or an option, a percentage for the page."""
    number, meant = given if isinstance(given, float | int) else None, ""
    share = share_of(given) if isinstance(given, str) else None
    least, most = (
        next(bound for rule in field.metadata for name in names if (bound := _bound(rule, name)) is not None)
        for names in (("ge", "gt"), ("le", "lt"))
    )
    if isinstance(given, str) and DECIMAL_COMMA.fullmatch(given.strip()):
        number = float(given.strip().replace(",", "."))
        meant = f": write {number:g}"
    elif number is not None and most < number and 100.0 * least <= number <= 100.0 * most:
        meant = f": write {number:g}%"
    terminal = f"{_shown(given) if share is None else given}: it must be {allowed(field)} or a percentage{meant}"
    number = number if share is None else share
    shown = _shown(given) if number is None else f"{100.0 * number:.6g} %"
    return phrase("page", terminal, f"{shown}: it must be a percentage{_range(field.metadata, 100.0)}")


def _rareness(entry: tuple[str, FieldInfo]) -> bool:
    """Whether not everybody needs a key."""
    extra: Any = entry[1].json_schema_extra
    return (extra or {}).get("level") != "simple"


def _with_marks(text: str, table: str, fields: Collection[str]) -> str:
    """The text with its keys of a table marked, but for those that are plain words as well, as "walls"."""
    return KEY.sub(lambda word: key_name(f"{table}.{word[0]}", word[0]) if word[0] in fields else word[0], text)


def nearest(key: str, known: list[str]) -> str | None:
    """The known key most similar to a mistyped one: one in its table that begins with it, or is like its last word, else in any
    table."""
    table, _, word = key.rpartition(".")
    same = {name.rpartition(".")[2]: name for name in known if name.rpartition(".")[0] == table}
    every = {name.rpartition(".")[2]: name for name in known}
    begun = next((name for last, name in same.items() if last.startswith(f"{word}_")), None)
    return begun or next((names[close[0]] for names in (same, every) if (close := get_close_matches(word, names, 1, 0.7))), None)


def _field(root: type[BaseModel], steps: tuple[str | int, ...]) -> FieldInfo | None:
    """The innermost field on the path of an error."""
    model: type[BaseModel] | None = root
    field = None
    for step in steps:
        if isinstance(step, int):
            continue
        if model is None or step not in model.model_fields:
            return field
        field = model.model_fields[step]
        model = _model(field.annotation)
    return field


def _table(root: type[BaseModel], steps: tuple[str | int, ...]) -> type[BaseModel] | None:
    field = _field(root, steps)
    return root if field is None else _model(field.annotation)


def _model(annotation: Any) -> type[BaseModel] | None:
    candidates = (annotation, *get_args(annotation))
    return next((kind for kind in candidates if isinstance(kind, type) and issubclass(kind, BaseModel)), None)


def _allowed(annotation: Any, metadata: list[Any]) -> str:
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        return ("one of " if len(inner) > 1 else "") + ", ".join(_shown(value) for value in inner)
    if origin in (UnionType, Union):
        return _allowed(inner[0], metadata)
    if origin is tuple:
        return f"a list of {('', '', 'two', 'three')[len(inner)]} numbers"
    if origin is list:
        return _list(inner[0], metadata)
    if hasattr(annotation, "__metadata__"):
        return _allowed(inner[0], [*annotation.__metadata__])
    if annotation is bool:
        return "true or false"
    if isinstance(annotation, type) and issubclass(annotation, Enum):
        return f"one of {', '.join(_shown(member.value) for member in annotation)}"
    if annotation is str:
        pattern = next((text for rule in metadata for text in [_bound(rule, "pattern")] if text), None)
        longest = next((most for rule in metadata for most in [_bound(rule, "max_length")] if most), None)
        return _matching(pattern) if pattern else f"a text of at most {longest} characters" if longest else "a text"
    if annotation in (int, float):
        return ("a whole number" if annotation is int else "a number") + _range(metadata)
    model = _model(annotation)
    return f"a table with the keys {', '.join(model.model_fields)}" if model else "a table of keys"


def _matching(pattern: str) -> str:
    """The pattern of a text in words: a character from a few, or a name of certain characters."""
    letter, name = ONE_OF.fullmatch(pattern), NAME_OF.fullmatch(pattern)
    if letter:
        return f"one letter of {letter[1]}"
    if not name:
        return f"a text that matches {pattern}"
    kinds = [*(word for characters, word in KINDS if characters in name[1]), *re.sub("[A-Za-z0-9]-[A-Za-z0-9]", "", name[1])]
    return f"a name of {' and '.join([', '.join(kinds[:-1]), kinds[-1]]) if len(kinds) > 1 else kinds[0]}"


def _list(item: Any, metadata: list[Any]) -> str:
    model = _model(item)
    if model is not None:
        return f"a list of tables with the keys {', '.join(model.model_fields)}"
    if item is str:
        return "a list of texts"
    most = next((most for rule in metadata if (most := _bound(rule, "max_length"))), None)
    needed = " one or more" if any(_bound(rule, "min_length") for rule in metadata) else f" at most {most}" if most else ""
    number = _allowed(get_args(item)[0], []).removeprefix("a ").replace("number", "numbers")
    return f"a list of{needed} pairs of {number}"


def _range(metadata: list[Any], scale: float = 1.0) -> str:
    bounds = {
        name: scale * value for rule in metadata for name in ("ge", "gt", "le", "lt") if (value := _bound(rule, name)) is not None
    }
    low = f" from {bounds['ge']:g}" if "ge" in bounds else f" above {bounds['gt']:g}" if "gt" in bounds else ""
    high = f" to {bounds['le']:g}" if "le" in bounds else f" and below {bounds['lt']:g}" if "lt" in bounds else ""
    return low + (f" and{high.replace(' to', ' up to')}" if low.startswith(" above") and high.startswith(" to") else high)


def _bound(rule: Any, name: str) -> Any:
    """The bound of a constraint: an attribute in annotated-types, nested in the metadata of pydantic's Field."""
    for holder in (rule, *getattr(rule, "metadata", ())):
        value = getattr(holder, name, None)
        if value is not None:
            return value
    return None


def _shown(value: Any) -> str:
    """A value as TOML, shortened if long."""
    try:
        text = json.dumps(value, ensure_ascii=False, allow_nan=False)
    except (TypeError, ValueError):
        text = str(value)
    return text if len(text) <= LONGEST_VALUE else f"{text[:LONGEST_VALUE]}..."
