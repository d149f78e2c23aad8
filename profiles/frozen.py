"""Frozen: the base of all validated values of a profile, and the declaration of their keys."""

import re
from collections.abc import Callable, Iterable
from enum import IntEnum
from functools import partial
from types import NoneType
from typing import Any, Self, get_args

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    field_validator,
    model_validator,
)
from pydantic_core import PydanticCustomError

Vector = tuple[float, float, float]
Limits = tuple[float, float]
KEY_BY_KEY = "key by key"  # context of a validation that skips checks between keys
# Groups of keys: a class of process settings, a table of the machine, or a section.
TITLES = {
    "process: layers": "Layers and lines",
    "process: shell": "Walls, top and bottom",
    "process: finish": "Sizes and smooth tops",
    "process: infill": "Infill",
    "process: support": "Support and bridges",
    "process: plate": "Skirt, brim and plate",
    "process: interface": "Joints between parts",
    "process: motion": "Speeds and travels",
    "material": "Material",
    "search": "Finding parts",
    "machine": "Machine",
    "machine.x": "X axis",
    "machine.y": "Y axis",
    "machine.z": "Z axis",
    "machine.tilt": "Tilt axis",
    "machine.turn": "Turn axis",
    "machine.table": "Table",
    "machine.head": "Print head",
    "machine.gcode": "G-code blocks",
}
UNITS = (  # ending of a key's name -> unit on a page
    ("_g_cm3", "g/cm³"),
    ("_mm3_s", "mm³/s"),
    ("_mm_s2", "mm/s²"),
    ("_deg_s2", "°/s²"),
    ("_mm_s", "mm/s"),
    ("_deg_s", "°/s"),
    ("_c_s", "°C/s"),
    ("_mm2", "mm²"),
    ("_mm", "mm"),
    ("_deg", "°"),
    ("_c", "°C"),
    ("_s", "s"),
    ("_min", "min"),
    ("_mpa", "MPa"),
    ("_n", "N"),
    ("_px", "px"),
    ("_bytes", "bytes"),
    *((ending, "%") for ending in ("_share", "_density", "flow", "_overlap", "_bulge", "seam_gap", "_weld_factor", "_saving")),
    *(
        (ending, "%")
        for ending in ("fan", "fan_least", "fan_bridge", "fan_infill_bridge", "least_gain", "_gain_preferred", "scale")
    ),
)
PERCENT = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)) ?%")


class Effect(IntEnum):
    """Effect of a changed key on a front of parts found before, from least to greatest: none, its rows have other prices, the
    machine may reach fewer of them, or a search may find another front.
    """

    NONE = 0
    PRICES = 1
    REACH = 2
    FRONT = 3


def _key(level: str, title: str, synonyms: str = "", effect: Effect | None = None, **allowed: Any) -> Callable[[Any, str], Any]:
    """A key of a profile. Its default (`...` if it has none) and meaning are the arguments of the returned function.

    Two calls keep a key within a few lines: in a single call each argument would take its own line. level: who needs the key;
    title: its name on a page; synonyms: words of other slicers that neither title nor key contains; effect: of a change on the
    parts that a search has found, None: the default of the key's section in profiles.effect; allowed: restrictions for pydantic's
    Field.
    """

    def field(default: Any, description: str) -> Any:
        extra: dict[str, Any] = {"level": level, "synonyms": synonyms} | ({} if effect is None else {"effect": effect})
        return Field(default, title=title, description=description, json_schema_extra=extra, **allowed)

    return field


# Keys that everybody needs, keys for tuning a print, and keys for building a machine or studying the method.
simple, advanced, rare = (partial(_key, level) for level in ("simple", "advanced", "all"))


class Frozen(BaseModel):
    """A validated value: unknown keys are refused, and nothing changes after loading."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @field_validator("*", mode="before")
    @classmethod
    def _left_out(cls, value: Any, info: ValidationInfo) -> Any:
        """Treat an empty text as no value for an optional key, also if an inherited profile has a value."""
        return None if value == "" and may_be_left_out(cls.model_fields[str(info.field_name)].annotation) else value

    @field_validator("*", mode="wrap")
    @classmethod
    def _percentage(cls, value: Any, validate: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
        """Read a percentage, such as "20%", for a key whose value is a share. An error holds it as it was written."""
        if not isinstance(value, str) or unit_of(str(info.field_name)) != "%" or (share := share_of(value)) is None:
            return validate(value)
        try:
            return validate(share)
        except ValidationError as error:
            raise PydanticCustomError("percentage", "{problem}", {"problem": str(error)}) from None

    @field_validator("*", mode="before")
    @classmethod
    def _no_truth_as_number(cls, value: Any, info: ValidationInfo) -> Any:
        """Refuse true and false where pydantic would read 1 and 0."""
        if isinstance(value, bool) and cls.model_fields[str(info.field_name)].annotation is not bool:
            raise PydanticCustomError("truth_as_number", "true and false are not numbers")
        return value

    def _problems(self) -> Iterable[str]:
        """Problems between keys, each one sentence."""
        return ()

    @model_validator(mode="after")
    def _check(self, info: ValidationInfo) -> Self:
        """Raise all problems of the table at once, one per line; profiles.wording makes sentences of them."""
        sentences = () if info.context == KEY_BY_KEY else tuple(self._problems())
        if sentences:
            raise ValueError("\n".join(sentences))
        return self


def may_be_left_out(annotation: Any) -> bool:
    """Whether a key of this type may have no value."""
    return NoneType in get_args(annotation)


def share_of(text: str) -> float | None:
    """The share that a percentage means; None for other texts.

    >>> share_of("20%"), share_of("102.5 %"), share_of("0.2")
    (0.2, 1.025, None)
    """
    written = PERCENT.fullmatch(text)
    return float(f"{written[1]}e-2") if written else None


def unit_of(key: str) -> str:
    """The unit of a key's value as shown on a page; "" if it has none. A share from 0 to 1 is shown in %.

    >>> unit_of("machine.tilt.acceleration_deg_s2"), unit_of("process.infill_density"), unit_of("process.walls")
    ('°/s²', '%', '')
    """
    return next((unit for ending, unit in UNITS if key.endswith(ending)), "")
