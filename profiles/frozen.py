"""Frozen: what all validated values of a profile share."""

from collections.abc import Iterable
from types import NoneType
from typing import Any, Self, get_args

from pydantic import BaseModel, ConfigDict, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

Vector = tuple[float, float, float]
Limits = tuple[float, float]
KEY_BY_KEY = "key by key"  # context of a validation that leaves out what keys must be together


class Frozen(BaseModel):
    """A validated value: unknown keys are refused, nothing changes after loading."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @field_validator("*", mode="before")
    @classmethod
    def _left_out(cls, value: Any, info: ValidationInfo) -> Any:
        """An empty text leaves out what may be left out, also where a profile that is inherited has a value."""
        return None if value == "" and may_be_left_out(cls.model_fields[str(info.field_name)].annotation) else value

    @field_validator("*", mode="before")
    @classmethod
    def _no_truth_as_number(cls, value: Any, info: ValidationInfo) -> Any:
        """Refuses true and false where pydantic would read 1 and 0."""
        if isinstance(value, bool) and cls.model_fields[str(info.field_name)].annotation is not bool:
            raise PydanticCustomError("truth_as_number", "true and false are no numbers")
        return value

    def _problems(self) -> Iterable[str]:
        """What the keys must be together and are not, each one sentence."""
        return ()

    @model_validator(mode="after")
    def _check(self, info: ValidationInfo) -> Self:
        """Raise all problems of the table at once, one a line: profiles.wording makes a sentence of each."""
        sentences = () if info.context == KEY_BY_KEY else tuple(self._problems())
        if sentences:
            raise ValueError("\n".join(sentences))
        return self


def may_be_left_out(annotation: Any) -> bool:
    """Whether a key of this type may have no value."""
    return NoneType in get_args(annotation)
