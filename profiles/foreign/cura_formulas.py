"""Cura's formulas: values of settings that depend on others (`=line_width * 2`), in a file and in Cura's own definitions.

Formulas are Python expressions (Cura, UM/Settings/SettingFunction.py); those of the definitions are in
resources/definitions/fdmprinter.def.json. Only arithmetic on settings with a value in the file is computed.
"""

import ast
import math
import operator
import re
from collections.abc import Callable, Mapping
from typing import Any

USUAL = {  # formulas in Cura's definitions for values usually set by another setting
    "magic_spiralize": "False",
    "line_width": "machine_nozzle_size",
    "wall_line_width": "line_width",
    "wall_line_width_0": "wall_line_width",
    "wall_line_width_x": "wall_line_width",
    "wall_line_count": "max(1, round((wall_thickness - wall_line_width_0) / wall_line_width_x) + 1) if wall_thickness else 0",
    "top_thickness": "top_bottom_thickness",
    "bottom_thickness": "top_bottom_thickness",
    "top_layers": "math.ceil(round(top_thickness / layer_height, 4))",
    "bottom_layers": "math.ceil(round(bottom_thickness / layer_height, 4))",
    "speed_infill": "speed_print",
    "speed_wall": "speed_print / 2",
    "speed_wall_0": "speed_wall",
    "speed_wall_x": "speed_wall * 2",
    "speed_topbottom": "speed_print / 2",
    "speed_support": "speed_print",
    "acceleration_infill": "acceleration_print",
    "acceleration_wall": "acceleration_print",
    "acceleration_wall_0": "acceleration_wall",
    "cool_fan_speed_max": "cool_fan_speed",
    "cool_fan_speed_min": "cool_fan_speed",
    "support_top_distance": "support_z_distance",
    "material_print_temperature": "default_material_print_temperature",
    "material_bed_temperature": "default_material_bed_temperature",
}
NAME = re.compile(r"[A-Za-z_]\w*")
OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.USub: operator.neg,
    ast.Not: operator.not_,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}
FUNCTIONS: dict[str, Callable[..., Any]] = {
    "max": max,
    "min": min,
    "round": round,
    "int": int,
    "math.ceil": math.ceil,
    "math.floor": math.floor,
}
DEEPEST = 12  # nested formulas; a cycle would never end


def evaluated(values: Mapping[str, str]) -> dict[str, str]:
    """The values with formulas computed where all their names are known; other values are unchanged."""
    worked = dict(values)
    for key in (*values, *USUAL):
        if values.get(key, "=").startswith("="):
            try:
                worked[key] = _text(_value(key, values, 0))
            except (LookupError, ArithmeticError, TypeError, ValueError, SyntaxError):
                continue
    return worked


def inputs(key: str, values: Mapping[str, str]) -> set[str]:
    """The settings of a file that a value depends on by formulas, without itself."""
    found, waiting = set[str](), [key]
    while waiting:
        name = waiting.pop()
        text = values.get(name, "=" + USUAL.get(name, ""))
        named = set(NAME.findall(text)) & (values.keys() | USUAL.keys()) - found if text.startswith("=") else set[str]()
        found |= named
        waiting += sorted(named)
    return (found & values.keys()) - {key}


def _value(key: str, values: Mapping[str, str], deep: int) -> Any:
    """The value of a setting. Raises LookupError if a setting has no value, or for an unsupported expression."""
    text = values.get(key, "=" + USUAL.get(key, ""))
    if text == "=" or deep > DEEPEST:
        raise LookupError(key)
    if text.startswith("="):
        return _evaluate(ast.parse(text[1:].strip(), mode="eval").body, values, deep + 1)
    try:
        return ast.literal_eval(text)
    except (ValueError, SyntaxError):
        return text


def _evaluate(node: ast.AST, values: Mapping[str, str], deep: int) -> Any:
    """The value of an expression. Raises LookupError if a setting has no value, or for an unsupported expression."""
    match node:
        case ast.Constant(value=value):
            return value
        case ast.Name(id=name):
            return _value(name, values, deep)
        case ast.IfExp(test=test, body=body, orelse=other):
            return _evaluate(body if _evaluate(test, values, deep) else other, values, deep)
        case ast.UnaryOp(op=operation, operand=operand) if type(operation) in OPERATORS:
            return OPERATORS[type(operation)](_evaluate(operand, values, deep))
        case ast.BinOp(left=left, op=operation, right=right) if type(operation) in OPERATORS:
            return OPERATORS[type(operation)](_number(left, values, deep), _number(right, values, deep))
        case ast.Compare(left=left, ops=[operation], comparators=[right]) if type(operation) in OPERATORS:
            return OPERATORS[type(operation)](_evaluate(left, values, deep), _evaluate(right, values, deep))
        case ast.BoolOp(op=ast.And(), values=terms):
            return all(_evaluate(term, values, deep) for term in terms)
        case ast.BoolOp(op=ast.Or(), values=terms):
            return any(_evaluate(term, values, deep) for term in terms)
        case ast.Call(func=called, args=[ast.Constant(value=str(name))]) if ast.unparse(called) == "resolveOrValue":
            return _value(name, values, deep)
        case ast.Call(func=called, args=terms, keywords=[]) if (function := FUNCTIONS.get(ast.unparse(called))) is not None:
            return function(*(_number(term, values, deep) for term in terms))
    raise LookupError(ast.unparse(node))


def _number(node: ast.AST, values: Mapping[str, str], deep: int) -> float:
    value = _evaluate(node, values, deep)
    if not isinstance(value, int | float):
        raise LookupError(ast.unparse(node))
    return value


def _text(value: Any) -> str:
    """A value as Cura's files write it."""
    return f"{value:.9g}" if isinstance(value, int | float) and not isinstance(value, bool) else str(value)
