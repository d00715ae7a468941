"""Who may import what: the scene and the files serve everyone, libraries stay where they belong.

Read from the syntax trees, so that an import inside a function counts like any other.
"""

import ast
from collections.abc import Iterator
from fnmatch import fnmatchcase
from pathlib import Path

import pytest

from solver import plan

pytestmark = pytest.mark.serial

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("solver", "partition", "render", "runs", "tests")

# The leaves: what a scene is, and what a file holds.
SCENE = ("solver.scene", "solver.scene_*", "solver.schema", "solver.formula")
FILES = ("solver.files", "solver.files_*")

# Beyond itself, a package may import only these modules of ours.
BEYOND = {
    "partition": (*SCENE, *FILES),
    "solver": ("partition.fragments",),
    "render": (*SCENE, *FILES, "partition.fragments"),
    "runs": ("*",),
    "tests": ("*",),
}

# Libraries that belong to a few modules; tests may use them all.
PETSC = ("solver.grid", "solver.pressure", "solver.swarm", "partition.spectral")
# May import what is named in a table or found in a folder: the stages, the benchmarks, all kernels.
BY_NAME = {"solver.plan", "runs.__main__", "runs.warm"}

HOME = {
    "petsc4py": PETSC,
    "slepc4py": ("partition.spectral",),
    "ducc0": ("solver.transform", "solver.helmholtz", "solver.estimate"),
    "mpi4py_fft": ("solver.poisson", "solver.transform"),
    "mpi4py": (*PETSC, "solver.interfaces", "solver.lines", "solver.run", "solver.step",
               "solver.bodies", "solver.monitor", "runs.bench.output", "runs.bench.pressure",
               "runs.bench.scaling", "runs.bench.speed", "runs.bench.stability", "*.__main__"),
    "h5py": (*FILES, "runs.bench.output"),   # the yardstick
    "argparse": ("*.__main__",),
}

# What an import inside a function may load: libraries that few scenes need, and modules of ours.
LAZY = ("meshio", "trimesh", "embreex", "colour", "matplotlib", "av", "OpenEXR", "PIL", "pyamg",
        "pymetis", "mitsuba", "drjit", "xarray", "pandas", "pyvista", "pxr", "pyopenvdb")

SOURCES = {".".join(path.relative_to(ROOT).with_suffix("").parts): path.read_text(encoding="utf-8")
           for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))}


def matches(name: str, patterns: tuple[str, ...]) -> bool:
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def is_ours(name: str) -> bool:
    return name.split(".")[0] in PACKAGES


def imports(source: str) -> Iterator[tuple[str, bool]]:
    """Every imported module, and whether the import stands inside a function."""
    def visit(node: ast.AST, in_function: bool) -> Iterator[tuple[str, bool]]:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.Import):
                for alias in child.names:
                    yield alias.name, in_function
            elif isinstance(child, ast.ImportFrom):
                base = "." * child.level + (child.module or "")
                for alias in child.names:
                    name = f"{base}.{alias.name}"
                    yield (name if name in SOURCES else base), in_function
            inner = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
            yield from visit(child, in_function or inner)
    yield from visit(ast.parse(source), False)


def complaints(module: str, source: str) -> Iterator[str]:
    """What a module imports although it may not."""
    package = module.split(".")[0]
    for name, in_function in imports(source):
        library = name.split(".")[0]
        if name.startswith("."):
            yield f"{name}: write the whole name of the module"
        elif is_ours(name):
            if library != package and not matches(name, BEYOND[package]):
                yield f"{name}: not for {package}"
            if matches(module, SCENE) and not matches(name, SCENE):
                yield f"{name}: the scene needs nothing but itself"
            if matches(module, FILES) and not matches(name, FILES):
                yield f"{name}: the files module needs nothing of ours"
        elif package != "tests":
            if library in HOME and not matches(module, HOME[library]):
                yield f"{library}: only for {', '.join(HOME[library])}"
            if in_function and library not in LAZY:
                yield f"{library}: inside a function, but it is not one of those loaded late"
    if (package != "tests" and module not in BY_NAME
            and ("import_module(" in source or "__import__(" in source)):
        yield "an import by a computed name, which no reader can follow"


def reachable(module: str) -> set[str]:
    """The top-level libraries loaded by a module and everything of ours that it imports."""
    seen: set[str] = set()
    libraries: set[str] = set()
    waiting = [module]
    while waiting:
        current = waiting.pop()
        if current in seen:
            continue
        seen.add(current)
        for name, _ in imports(SOURCES.get(current, "")):
            if is_ours(name):
                waiting.append(name)
            else:
                libraries.add(name.split(".")[0])
    return libraries


@pytest.mark.parametrize("module", SOURCES)
def test_module_imports_only_what_it_may(module):
    assert list(complaints(module, SOURCES[module])) == []


@pytest.mark.parametrize("module", [name for name in SOURCES if name.startswith("render.")
                                    or matches(name, (*SCENE, *FILES, "partition.fragments"))])
def test_renderer_and_leaves_run_without_petsc(module):
    assert reachable(module).isdisjoint({"petsc4py", "slepc4py", "mpi4py_fft"})


@pytest.mark.parametrize("module", [name for name in SOURCES if matches(name, (*SCENE, *FILES))])
def test_leaves_run_without_mpi(module):
    assert "mpi4py" not in reachable(module)


def test_stages_meet_only_in_the_state():
    stages = {f"solver.{stage.name}" for stage in plan.ORDER}
    assert stages <= SOURCES.keys()
    assert [(module, name) for module in stages for name, _ in imports(SOURCES[module])
            if name in stages] == []


@pytest.mark.parametrize("package", PACKAGES)
def test_package_file_is_empty(package):
    assert SOURCES[f"{package}.__init__"] == ""


@pytest.mark.parametrize("module, source", [
    ("render.image", "import petsc4py"),
    ("render.image", "from petsc4py import PETSc"),
    ("render.image", "def late():\n    from petsc4py import PETSc"),
    ("render.image", "from solver import grid"),
    ("render.image", "from partition.bfs import break_up"),
    ("partition.bfs", "import render"),
    ("partition.bfs", "if True:\n    import slepc4py.SLEPc"),
    ("solver.step", "import h5py"),
    ("solver.step", "from partition import bfs"),
    ("solver.step", "import runs.chain"),
    ("solver.step", "from . import grid"),
    ("solver.step", "import importlib\nimportlib.import_module('h5py')"),
    ("solver.scene", "import argparse"),
    ("solver.scene", "from solver.files import open_file"),
    ("solver.files", "from solver.scene import Scene"),
    ("solver.cool", "def late():\n    import ducc0.fft"),
])
def test_rules_catch(module, source):
    assert list(complaints(module, source)) != []


@pytest.mark.parametrize("module, source", [
    ("solver.grid", "from petsc4py import PETSc\nfrom mpi4py import MPI"),
    ("solver.bodies", "from partition.fragments import Fragments"),
    ("solver.plan", "def plan():\n    from solver import grid"),
    ("partition.mesh", "def read():\n    import meshio"),
    ("render.__main__", "import argparse\nfrom solver import scene, files"),
    ("tests.test_any", "import h5py\nfrom render import camera\nfrom petsc4py import PETSc"),
])
def test_rules_allow(module, source):
    assert list(complaints(module, source)) == []
