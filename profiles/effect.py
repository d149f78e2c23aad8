"""Effect of a changed setting on parts that a search has already found.

A search reads all of its own keys, most keys of the machine and few of process and material; its parts are priced afterwards.
Each section therefore has a usual effect, and a key with another one declares it.
"""

from collections.abc import Iterator
from typing import Any

from pydantic.fields import FieldInfo

from profiles.frozen import Effect, Frozen
from profiles.profile import Profile

USUAL = {"process": Effect.PRICES, "material": Effect.PRICES, "machine": Effect.FRONT, "search": Effect.FRONT}


def effect_of_change(before: Profile, after: Profile) -> Effect:
    """The greatest effect of all differences between two profiles, except for settings of single parts, which no search reads."""
    several = (_effects(getattr(before, section), getattr(after, section), usual) for section, usual in USUAL.items())
    return max((effect for effects in several for effect in effects), default=Effect.NONE)


def _effects(before: Frozen, after: Frozen, usual: Effect) -> Iterator[Effect]:
    for name, field in type(after).model_fields.items():
        old, new = getattr(before, name), getattr(after, name)
        if isinstance(old, Frozen) and isinstance(new, Frozen):
            yield from _effects(old, new, usual)
        elif old != new:
            yield _effect(field, usual)


def _effect(field: FieldInfo, usual: Effect) -> Effect:
    extra: Any = field.json_schema_extra
    return Effect((extra or {}).get("effect", usual))
