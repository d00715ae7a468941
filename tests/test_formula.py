"""A formula of a scene is arithmetic: nothing else is evaluated, and nothing takes for ever."""

import pytest

from solver.formula import FormulaError, check

pytestmark = pytest.mark.serial

NAMES = ("x", "y", "pi")


@pytest.mark.parametrize("text", [
    "0", "sin(2*pi*x)*exp(-y**2)", "where((x > 0.5) & (y <= 1), 1.0, -x)", "arctan2(y, x) % 2",
    "--x", "2**-1", "x**y", "sqrt(0.5 - x)", "+".join(["x*y"] * 200)])
def test_arithmetic(text):
    check(text, NAMES)


@pytest.mark.parametrize("text, word", [
    ("__import__('os').system('touch trap')", "not arithmetic"), ("x.__class__", "not arithmetic"),
    ("x.real", "not arithmetic"), ("'a'", "not arithmetic"), ("x[0]", "not arithmetic"),
    ("lambda: 1", "not arithmetic"), ("x if x else y", "not arithmetic"), ("1j", "not arithmetic"),
    ("sum(x)", "not arithmetic"), ("sin(x, y)", "not arithmetic"), ("0 < x < 1", "not arithmetic"),
    ("f(x)", "not arithmetic"), ("x, y", "not arithmetic"), ("(x := 1)", "not arithmetic"),
    ("t", "'t' is unknown"), ("x +", "SyntaxError"), ("\x00", "null"), ("x;y", "SyntaxError"),
    ("9**9**9**9", "no finite number"), ("1e999", "finite"), ("1/0", "no finite number"),
    ("(-1)**0.5", "finite"), ("10**400*x", "no finite number"), ("x" * 5000, "longer"),
    ("x+" * 1900 + "x", "too deep"), ("(" * 1500 + "x" + ")" * 1500, "many nested")])
def test_all_else_is_refused(text, word):
    with pytest.raises(FormulaError, match=word) as error:
        check(text, NAMES)
    assert len(str(error.value)) < 250
