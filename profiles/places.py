"""Places: the locations of profiles (shipped with the program, the user's own folder, any file) and inheritance."""

import os
from collections.abc import Iterable, Mapping
from copy import deepcopy
from difflib import get_close_matches
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from profiles.errors import ProfileError, reason
from profiles.folders import settings_folder
from profiles.toml_text import read_toml

KINDS = {"machine": "machines", "material": "materials", "process": "processes"}
OF_KIND = {"machine": ("machine",), "material": ("material",), "process": ("process", "search")}
PARENT = "inherits"
MOST_INHERITED = 32  # profiles in one chain of inheritance


def shipped(kind: str) -> list[str]:
    """Names of the shipped profiles of a kind ("machine", "material" or "process"), sorted."""
    folder = resources.files("profiles") / KINDS[kind]
    return sorted(f.name[:-5] for f in folder.iterdir() if f.name.endswith(".toml"))


def shipped_of_dialect(dialect: str) -> list[str]:
    """Names of the shipped machines with a firmware dialect, sorted."""
    return [name for name in shipped("machine") if _shipped_document("machine", name)["machine"]["dialect"] == dialect]


def own_folder(kind: str) -> Path:
    """The user's folder for profiles of a kind, in $XDG_CONFIG_HOME or the system's usual place for settings."""
    return settings_folder() / "profiles" / KINDS[kind]


def own(kind: str) -> list[str]:
    """Names of the user's own profiles of a kind, sorted; one with a shipped profile's name replaces it."""
    try:
        return sorted(file.stem for file in own_folder(kind).glob("*.toml"))
    except PermissionError:  # the home of another user, as sudo may leave it
        return []


def known(kind: str) -> list[str]:
    """All names of a kind, shipped and the user's own, sorted."""
    return sorted({*shipped(kind), *own(kind)})


def kind_of(name: str) -> str:
    """The kind of a profile, given by name or file: machine, material or process."""
    for kind in KINDS:
        if name in known(kind):
            return kind
    if not is_file_name(name):
        raise _unknown("profile", name, (known_name for kind in KINDS for known_name in known(kind)))
    return kind_in(Path(name))


def kind_in(path: Path) -> str:
    """The kind of a profile file, from its tables."""
    document = parse(path)
    kind = next((kind for kind, sections in OF_KIND.items() if any(section in document for section in sections)), None)
    if kind is None:
        raise ProfileError(f"{path}: no [machine], [material], [process] or [search] table")
    return kind


def tables(kind: str, name: str, seen: tuple[str, ...] = ()) -> dict[str, Any]:
    """The tables of a profile, given by name or path, with inherited ones. Raises ProfileError if there is no such profile."""
    document, source = _document(kind, name, seen)
    if source in seen:
        raise ProfileError(f"{name} inherits itself through {', '.join(seen[seen.index(source) + 1 :]) or 'its own name'}")
    if len(seen) >= MOST_INHERITED:
        raise ProfileError(f"{name} is inherited through {len(seen)} profiles: at most {MOST_INHERITED} are allowed")
    problem = strangers(kind, name, document)
    if problem:
        raise ProfileError(problem)
    return merged(inherited(kind, name, document, (*seen, source)), own_tables(document))


def shipped_base(kind: str, name: str) -> str | None:
    """The shipped profile that a profile is or inherits, directly or not; None if it inherits nothing, or if a user's profile
    replaces the shipped one.
    """
    seen: tuple[str, ...] = ()
    while True:
        document, source = _document(kind, name, seen)
        if source == name and name in shipped(kind):
            return None if name in own(kind) else name
        parent = document.get(PARENT)
        if parent is None:
            return None
        name, seen = _parent_of(name, parent), (*seen, source)


def inherited(kind: str, name: str, document: Mapping[str, Any], seen: tuple[str, ...] = ()) -> dict[str, Any]:
    """The tables of the profile that a document inherits; empty if it inherits nothing."""
    parent = document.get(PARENT)
    if parent is None:
        return {}
    if not isinstance(parent, str):
        raise ProfileError(f"{name}: inherits is {parent!r}: the name of one profile or the path of one .toml file is expected")
    return tables(kind, _parent_of(name, parent), seen)


def _parent_of(name: str, parent: str) -> str:
    """The name of the profile that another inherits; a file's path is relative to the inheriting one."""
    return str(Path(name).parent / parent) if Path(parent).suffix == ".toml" else parent


def strangers(kind: str, name: str, document: Mapping[str, Any]) -> str | None:
    """The unknown tables and keys of a document, as a sentence."""
    unknown = [key for key in document if key not in (*OF_KIND[kind], PARENT)]
    if not unknown and own_tables(document):
        return None
    named = ", ".join(f"[{key}]" if isinstance(document[key], dict) else repr(key) for key in unknown)
    what = f"{named} cannot stand in a {kind} profile" if unknown else f"this is not a {kind} profile"
    meant = " (did you mean inherits?)" if misspelt_parent(document) else ""
    return f"{name}: {what}{meant}: its tables are {' and '.join(f'[{section}]' for section in OF_KIND[kind])}"


def misspelt_parent(document: Mapping[str, Any]) -> bool:
    """Whether a document has a misspelt `inherits` key."""
    words = [key for key, value in document.items() if isinstance(value, str)]
    return PARENT not in document and bool(get_close_matches(PARENT, words, 1, 0.7))


def own_tables(document: Mapping[str, Any]) -> dict[str, Any]:
    """A document without the name of its parent."""
    return {key: value for key, value in document.items() if key != PARENT}


def merged(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Tables merged key by key; other values are replaced."""
    out = dict(base)
    for key, value in over.items():
        below = out.get(key)
        out[key] = merged(below, value) if isinstance(below, dict) and isinstance(value, dict) else value
    return out


def parse(path: Path, what: str = "profile") -> dict[str, Any]:
    """The content of a TOML file. Raises ProfileError with the reason. what: the file's name in messages."""
    try:
        return read_toml(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ProfileError(f"{what} {path} cannot be read: {reason(error)}") from None
    except UnicodeDecodeError:
        raise ProfileError(f"{what} {path} is not a text file: TOML in UTF-8 is expected") from None
    except ValueError as error:
        raise ProfileError(f"{what} {path} is not valid TOML: {error}") from None


def _document(kind: str, name: str, seen: tuple[str, ...]) -> tuple[dict[str, Any], str]:
    """A profile's own tables and where they are: the shipped name or the file's full path.

    A user's profile that inherits its own name inherits the shipped one that it replaces.
    """
    file = own_folder(kind) / f"{name}.toml"
    if name in own(kind) and not (str(file.resolve()) in seen and name in shipped(kind)):
        return parse(file), str(file.resolve())
    if name in shipped(kind):
        return deepcopy(_shipped_document(kind, name)), name
    if is_file_name(name):
        return parse(Path(name)), str(Path(name).resolve())
    raise _unknown(f"{kind} profile", name, known(kind))


@cache
def _shipped_document(kind: str, name: str) -> dict[str, Any]:
    """The tables of a shipped profile, read once, since they do not change while a program runs."""
    source = resources.files("profiles") / KINDS[kind] / f"{name}.toml"
    return read_toml(source.read_text(encoding="utf-8"))


def _unknown(what: str, name: str, names: Iterable[str]) -> ProfileError:
    allowed = sorted(names)
    near = get_close_matches(name.lower(), allowed, 1, 0.7)
    hint = f" (did you mean {near[0]}?)" if near else ""
    return ProfileError(
        f"{what} {name!r} is not known{hint}: it must be one of {', '.join(allowed)}, or the path of a .toml file"
    )


def is_file_name(name: str) -> bool:
    """Whether a profile is given as a file."""
    return bool(name) and (Path(name).suffix == ".toml" or os.path.exists(name))
