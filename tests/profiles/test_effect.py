"""Settings that leave a front valid: those that neither a search nor the pricing of its rows reads."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from machine.pipeline.choice import pricing
from mdp.search.search import decompose
from profiles.effect import USUAL, effect_of_change
from profiles.frozen import Effect, Frozen
from profiles.profile import SECTIONS, Profile, load
from profiles.wording import keys
from tests.shapes import tee

QUICK = ("search.directions=40", "search.beam_width=2", "process.layer_height_mm=0.4", "process.line_width_mm=0.8")
VARIANTS = [
    (),
    ("process.support=none",),
    ("search.objective=risky",),
    ("search.clearance=false",),
]


@contextmanager
def reading(profile: Profile) -> Iterator[set[str]]:
    """The keys of a profile (section.key) that are read meanwhile; a key of an axis counts for all axes of its kind."""
    owners = {type(model): name for name, model in _models("", profile)}
    keys = {
        kind: [key for key in kind.model_fields if not isinstance(_sample(profile, owners[kind], key), Frozen)] for kind in owners
    }
    seen: set[str] = set()
    with pytest.MonkeyPatch.context() as patch:
        for kind in owners:
            patch.setattr(kind, "__getattribute__", _recording(kind, owners[kind], frozenset(keys[kind]), seen))
        yield seen


def _recording(kind: type, owner: str, keys: frozenset[str], seen: set[str]) -> object:
    before = kind.__getattribute__

    def read(model: object, name: str) -> object:
        if name in keys:
            seen.add(f"{owner}{name}")
        return before(model, name)

    return read


def _models(prefix: str, model: Frozen) -> Iterator[tuple[str, Frozen]]:
    for key in type(model).model_fields:
        value = getattr(model, key)
        if isinstance(value, Frozen):
            yield f"{prefix}{key}.", value
            yield from _models(f"{prefix}{key}.", value)


def _sample(profile: Profile, owner: str, key: str) -> object:
    value: object = profile
    for step in (*owner.rstrip(".").split("."), key):
        value = getattr(value, step)
    return value


def effect_of(key: str) -> Effect:
    """The declared effect of a key, or the default of its section."""
    section = key.partition(".")[0]
    declared = dict(keys(SECTIONS[section], f"{section}."))[key].json_schema_extra
    return Effect(declared["effect"]) if isinstance(declared, dict) and "effect" in declared else USUAL[section]


@pytest.mark.parametrize("settings", VARIANTS)
def test_a_search_reads_only_what_takes_the_front_away_and_prices_nothing_that_leaves_it(settings: tuple[str, ...]) -> None:
    profile = load(settings=(*QUICK, "process.first_layer_height_mm=0.4", *settings))
    with reading(profile) as by_search:
        decomposition = decompose(tee(), "model", profile)
    with reading(profile) as by_prices:
        pricing(profile)(decomposition.parts)
    assert "process.self_supporting_angle_deg" in by_search
    assert {key for key in by_search if effect_of(key) < Effect.REACH} == set()
    assert "process.infill_density" in by_prices
    assert {key for key in by_prices if effect_of(key) == Effect.NONE} == set()


@pytest.mark.parametrize(
    ("setting", "effect"),
    [
        ("material.nozzle_c=205", Effect.NONE),
        ("machine.name=mine", Effect.NONE),
        ('machine.gcode.end="M84"', Effect.NONE),
        ('machine.sources={"machine.x" = "measured"}', Effect.NONE),
        ("process.infill_density=0.5", Effect.PRICES),
        ("machine.x.speed_mm_s=50", Effect.PRICES),
        ("process.self_supporting_angle_deg=30", Effect.FRONT),
        ("machine.tilt.limits_deg=[-20, 20]", Effect.FRONT),
        ("machine.head.boxes=[]", Effect.FRONT),
        ("search.seam_mm=0", Effect.FRONT),
    ],
)
def test_the_effect_of_a_change_on_a_front(setting: str, effect: Effect) -> None:
    assert effect_of_change(load(), load(settings=[setting])) == effect
    assert effect_of_change(load(settings=[setting]), load(settings=[setting])) == Effect.NONE
