"""Is a formula of a scene arithmetic and nothing else? Read from its syntax, before evaluation.

numexpr compiles a formula by letting Python evaluate its text. So only numbers, the variables, the
operators below and numexpr's functions of numbers may stand in it: no text, attribute, index,
lambda or chain of comparisons. What is constant is worked out here first in floating point:
9**9**9**9, which Python would try with all its digits, is refused.
"""

import ast
import math
import operator
from collections.abc import Sequence

import numexpr

LONGEST = 4000    # characters
DEEPEST = 300     # operations within operations
FUNCTIONS = {name: 1 for name in (
    "abs", "arccos", "arccosh", "arcsin", "arcsinh", "arctan", "arctanh", "ceil", "cos", "cosh",
    "exp", "expm1", "floor", "log", "log10", "log1p", "sin", "sinh", "sqrt", "tan", "tanh")}
FUNCTIONS |= {"arctan2": 2, "fmod": 2, "where": 3}
OPERATORS = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
             ast.Div: operator.truediv, ast.Mod: operator.mod, ast.Pow: operator.pow}
LOGIC = ast.BitAnd, ast.BitOr
COMPARISONS = ast.Lt, ast.LtE, ast.Gt, ast.GtE, ast.Eq, ast.NotEq


class FormulaError(ValueError):
    """A formula that cannot be evaluated; the message says why."""


def check(text: str, variables: Sequence[str]) -> None:
    """Raises `FormulaError` where `text` is no formula of these variables."""
    problem = _problem(text, variables)
    if problem:
        raise FormulaError(f"{problem} (an expression of {', '.join(variables)}, as in "
                           "sin(2*pi*x))")


def _problem(text: str, variables: Sequence[str]) -> str:
    if len(text) > LONGEST:
        return f"longer than {LONGEST} characters"
    try:
        _constant(ast.parse(text, mode="eval").body, variables, DEEPEST)
    except SyntaxError as error:
        return f"{type(error).__name__}: {error.msg}"
    except ArithmeticError:
        return "a constant in it is no finite number"
    except (RecursionError, MemoryError):
        return "too deep"
    except ValueError as error:
        return str(error)
    found = numexpr.validate(text, local_dict=dict.fromkeys(variables, 0.5), global_dict={})
    return f"{type(found).__name__}: {found}" if found is not None else ""


def _constant(node: ast.expr, variables: Sequence[str], depth: int) -> float | None:
    """The value of a constant part, None of one with variables; raises ValueError for what is not
    allowed."""
    if depth == 0:
        raise ValueError("too deep")
    parts: list[ast.expr] = []
    match node:
        case ast.Constant(value=bool() | int() | float() as value):
            return _finite(float(value))
        case ast.Name(id=name):
            if name not in variables:
                raise ValueError(f"{name[:40]!r} is unknown")
            return None
        case ast.UnaryOp(op=ast.USub() | ast.UAdd() | ast.Invert(), operand=operand):
            value_ = _constant(operand, variables, depth - 1)
            return None if value_ is None else -value_ if isinstance(node.op, ast.USub) else value_
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            values = [_constant(part, variables, depth - 1) for part in (left, right)]
            if values[0] is None or values[1] is None:
                return None
            result = OPERATORS[type(op)](*values)
            return _finite(result)
        case ast.BinOp(left=left, op=op, right=right) if isinstance(op, LOGIC):
            parts = [left, right]
        case ast.Compare(left=left, ops=[op], comparators=[right]) if isinstance(op, COMPARISONS):
            parts = [left, right]
        case ast.Call(func=ast.Name(id=name), args=parts, keywords=[]) if (
                FUNCTIONS.get(name) == len(parts)):
            pass
        case _:
            raise ValueError(f"{ast.unparse(node)[:40]!r} is not arithmetic")
    for part in parts:
        _constant(part, variables, depth - 1)
    return None


def _finite(value: float | complex) -> float:
    if isinstance(value, complex) or not math.isfinite(value):
        raise ValueError(f"{value} is no finite number")
    return value
