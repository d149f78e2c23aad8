"""Option groups: a command takes a value whose fields are options, and the command line shows each of them by itself."""

from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import wraps
from inspect import Parameter, Signature, signature
from typing import Any


def with_option_groups(command: Callable[..., int]) -> Callable[..., int]:
    """The command as typer reads it: in the place of every parameter that is a dataclass, an option for each of its fields."""
    groups: dict[str, type[Any]] = {}
    parameters: list[Parameter] = []
    for name, parameter in signature(command).parameters.items():
        if not is_dataclass(parameter.annotation) or not isinstance(parameter.annotation, type):
            parameters.append(parameter.replace(kind=Parameter.KEYWORD_ONLY))
            continue
        groups[name] = parameter.annotation
        for field in fields(parameter.annotation):
            parameters.append(Parameter(field.name, Parameter.KEYWORD_ONLY, default=field.default, annotation=field.type))

    @wraps(command)
    def run(**given: Any) -> int:
        values = {name: group(**{field.name: given.pop(field.name) for field in fields(group)}) for name, group in groups.items()}
        return command(**given, **values)

    run.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    return run
