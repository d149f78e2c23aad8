"""Label: how one key of a profile is called, who needs it, and what other slicers call it."""

from dataclasses import dataclass
from enum import StrEnum


class Level(StrEnum):
    """Who needs a key: everybody, whoever tunes a print, or whoever builds a machine or studies the method."""

    SIMPLE = "simple"
    ADVANCED = "advanced"
    ALL = "all"


@dataclass(frozen=True)
class Label:
    """text: in place of the key; synonyms: words of other slicers that neither the text nor the key has."""

    text: str
    level: Level = Level.ALL
    synonyms: str = ""


def simple(text: str, synonyms: str = "") -> Label:
    """The label of a key that everybody needs."""
    return Label(text, Level.SIMPLE, synonyms)


def advanced(text: str, synonyms: str = "") -> Label:
    """The label of a key for whoever tunes a print."""
    return Label(text, Level.ADVANCED, synonyms)


def rare(text: str, synonyms: str = "") -> Label:
    """The label of a key that hardly anybody changes."""
    return Label(text, Level.ALL, synonyms)
