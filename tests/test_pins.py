"""The versions that are installed are those that setup.cfg asks for, each pinned once."""

import configparser
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

pytestmark = pytest.mark.serial

ROOT = Path(__file__).resolve().parent.parent
FROM_APT = {"numpy", "mpi4py", "petsc4py", "slepc4py", "mpi4py-fft", "h5py"}

config = configparser.ConfigParser()
config.read(ROOT / "setup.cfg", encoding="utf-8")
extras = dict(config["options.extras_require"])
APART = ("ecosystem", "peers")   # extras with a list of their own, installed only on request


def requirements(text):
    return [Requirement(line) for line in text.splitlines() if line and not line.startswith("#")]


def versions(name):
    """Pins of a file, and the version of each package."""
    found = requirements((ROOT / "runs" / name).read_text(encoding="utf-8"))
    return found, {canonicalize_name(pin.name): str(pin.specifier).removeprefix("==")
                   for pin in found}


asked_apart = [(extra, one) for extra in APART for one in requirements(extras.pop(extra))]
asked = [one for text in (config["options"]["install_requires"], *extras.values())
         for one in requirements(text)]
pins, pinned = versions("requirements.txt")
apart = {extra: versions(f"requirements-{extra}.txt") for extra in APART}


def test_every_package_is_pinned_once():
    for found, of_package in [(pins, pinned), *apart.values()]:
        assert len(of_package) == len(found)
        assert all(str(pin.specifier).startswith("==") for pin in found)


@pytest.mark.parametrize("extra, requirement", asked_apart, ids=str)
def test_pin_of_an_extra_of_its_own_satisfies_setup_cfg(extra, requirement):
    _, of_package = apart[extra]
    assert requirement.specifier.contains(of_package[canonicalize_name(requirement.name)])


@pytest.mark.parametrize("requirement", asked, ids=str)
def test_pin_satisfies_setup_cfg(requirement):
    name = canonicalize_name(requirement.name)
    assert (name in pinned) != (name in FROM_APT)
    if name in pinned:
        assert requirement.specifier.contains(pinned[name])


@pytest.mark.parametrize("name", pinned)
def test_what_a_pinned_package_needs_is_pinned(name):
    """They are installed without their dependencies, so the list has to be complete."""
    for text in metadata.requires(name) or ():
        needed = Requirement(text)
        if needed.marker is None or needed.marker.evaluate({"extra": ""}):
            other = canonicalize_name(needed.name)
            if other in FROM_APT:
                assert needed.specifier.contains(metadata.version(other)), text
            else:
                assert needed.specifier.contains(pinned.get(other, "0")), text
