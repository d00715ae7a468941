"""Every function of the solver states its types: to numba if it is a kernel, otherwise to mypy."""

import ast
from pathlib import Path

import pytest

pytestmark = pytest.mark.serial

SOLVER = Path(__file__).resolve().parent.parent / "solver"
TYPED_BY_NUMBA = {"kernel", "sweep", "inlined", "part_of_sweep"}   # of solver.kernel


def untyped(source):
    """Names of functions that are no kernels and leave a parameter or the result untyped."""
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.FunctionDef):
            continue
        decorators = {ast.unparse(d.func if isinstance(d, ast.Call) else d)
                      for d in node.decorator_list}
        arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs,
                     *filter(None, (node.args.vararg, node.args.kwarg))]
        typed = all(a.annotation or a.arg in ("self", "cls") for a in arguments)
        returns = node.returns or node.name == "__init__" and len(arguments) > 1
        if not (typed and returns) and decorators.isdisjoint(TYPED_BY_NUMBA):
            yield node.name


@pytest.mark.parametrize("path", sorted(SOLVER.glob("*.py")), ids=lambda path: path.stem)
def test_functions_are_typed(path):
    assert list(untyped(path.read_text(encoding="utf-8"))) == []


@pytest.mark.parametrize("source, names", [
    ("def f(x): pass", ["f"]),
    ("def f(x: int): pass", ["f"]),
    ("def f(x: int) -> int: return x", []),
    ("class A:\n    def __init__(self, x: int): pass\n    def g(self): pass", ["g"]),
    ("@kernel(REAL)\ndef f(x): pass", []),
    ("@inlined\ndef f(x): pass", []),
    ("@sweep(REAL)\ndef f(x): pass", []),
    ("@part_of_sweep\ndef f(x): pass", []),
    ("@property\ndef f(self): pass", ["f"]),
])
def test_rule_catches(source, names):
    assert list(untyped(source)) == names
