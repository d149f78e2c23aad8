"""Frozen: what all validated values of a profile share."""

from collections.abc import Iterable
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

Vector = tuple[float, float, float]
Limits = tuple[float, float]


class Frozen(BaseModel):
    """A validated value: unknown keys are refused, nothing changes after loading."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @field_validator("*", mode="before")
    @classmethod
    def _no_truth_as_number(cls, value: Any, info: ValidationInfo) -> Any:
        """Refuses true and false where pydantic would read 1 and 0."""
        if isinstance(value, bool) and cls.model_fields[str(info.field_name)].annotation is not bool:
            raise PydanticCustomError("truth_as_number", "true and false are no numbers")
        return value


def refuse(problems: Iterable[str]) -> None:
    """Raise all problems of a table at once, one a line: profiles.wording makes a sentence of each."""
    sentences = list(problems)
    if sentences:
        raise ValueError("\n".join(sentences))
