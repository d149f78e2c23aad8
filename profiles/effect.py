"""Effect of a changed setting on parts that were found before.

A search reads all of its own keys, most keys of the machine and few of process and material; the parts it finds are priced
afterwards. So each section has a usual effect, and keys with another one say so where they are declared.
"""

from collections.abc import Iterator
from typing import Any

from pydantic.fields import FieldInfo

from profiles.frozen import Effect, Frozen
from profiles.profile import SECTIONS, Profile
from profiles.wording import keys

USUAL = {"process": Effect.PRICES, "material": Effect.PRICES, "machine": Effect.FRONT, "search": Effect.FRONT}


def effect_of(key: str) -> Effect:
    """The effect of a key, with its section and dots. Raises KeyError for one that is not known."""
    section = key.partition(".")[0]
    return _effect(dict(keys(SECTIONS[section], f"{section}."))[key], USUAL[section])


def effect_of_change(before: Profile, after: Profile) -> Effect:
    """The greatest effect of all that differs between two profiles, the settings of single parts aside: no search reads them."""
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
