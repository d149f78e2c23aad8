"""Option groups: a command takes values whose fields are options, and the command line shows each field by itself."""

from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields, is_dataclass
from functools import wraps
from inspect import Parameter, Signature, signature
from typing import Annotated, Any, get_args, get_origin

import typer


def option(names: str, meaning: str, **further: Any) -> Any:
    """An option of the command line. names: as `-o --out FILE`, the placeholder of its value last where it has one."""
    *flags, last = names.split(" ")
    if not last.startswith("-"):
        further["metavar"] = last
    else:
        flags.append(last)
    return typer.Option(*flags, help=meaning, **further)


def with_option_groups(command: Callable[..., int]) -> Callable[..., int]:
    """The command as typer reads it: every parameter that is a dataclass becomes an option for each of its fields.

    A field may be such a dataclass itself. A tuple of any length becomes an option that can be repeated, empty by default.
    """
    annotations = {name: parameter.annotation for name, parameter in signature(command).parameters.items()}
    parameters: list[Parameter] = []
    for name, parameter in signature(command).parameters.items():
        parameters += _parameters(name, parameter.annotation, parameter.default)

    @wraps(command)
    def run(**given: Any) -> int:
        return command(**{name: _value(name, annotation, given) for name, annotation in annotations.items()})

    run.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    return run


def _is_group(annotation: Any) -> bool:
    return isinstance(annotation, type) and is_dataclass(annotation)


def _is_repeatable(annotation: Any) -> bool:
    values = get_args(annotation)[0] if get_origin(annotation) is Annotated else annotation
    return get_origin(values) is tuple and get_args(values)[1:] == (...,)


def _parameters(name: str, annotation: Any, default: Any) -> list[Parameter]:
    if _is_group(annotation):
        return [each for field in fields(annotation) for each in _parameters(field.name, field.type, field.default)]
    if _is_repeatable(annotation):
        values, option = get_args(annotation)
        annotation, default = Annotated[list[get_args(values)[0]] | None, option], None  # type: ignore[misc]
    return [
        Parameter(name, Parameter.KEYWORD_ONLY, default=Parameter.empty if default is MISSING else default, annotation=annotation)
    ]


def _value(name: str, annotation: Any, given: Mapping[str, Any]) -> Any:
    """What was given for a parameter: of a group an instance, of an option that can be repeated a tuple."""
    if _is_group(annotation):
        return annotation(**{field.name: _value(field.name, field.type, given) for field in fields(annotation)})
    return tuple(given[name] or ()) if _is_repeatable(annotation) else given[name]
