"""Solid pieces weigh what their volume does, and turn as an independent library says."""

import numpy as np
import pytest
import trimesh

from partition.build import Broken, assemble
from partition.figurines import statue
from partition.fracture import labels
from partition.fragments import Fragments
from partition.repair import repaired
from partition.solid import Solid, skins
from partition.tetrahedra import Tetrahedra, fill
from solver.inertia import mass_properties
from solver.scene_body import Fracture

DENSITY = 7.5
FRACTURES = [{"pieces": 2}, {"pieces": 17}, {"pieces": 33}, {"pieces": 100},
             {"pieces": 5, "method": "spectral"}]


@pytest.fixture(scope="module")
def body() -> Tetrahedra:
    return fill(repaired(*statue(0.08), "statue"), "statue")


def pieces_of(body: Tetrahedra, fracture: dict[str, object]) -> Fragments:
    label, _ = labels(Solid(body), Fracture.model_validate(fracture), (0.0, 0.0, 0.0))
    return assemble([Broken("statue", skins(body, label), True)])


@pytest.mark.parametrize("fracture", FRACTURES, ids=str)
def test_watertight_and_mass_centre_and_inertia_by_volume(body: Tetrahedra,
                                                          fracture: dict[str, object]) -> None:
    """Of every piece, to trimesh; all together, to the body in one piece."""
    fragments = pieces_of(body, fracture)
    assert fragments.count == fracture["pieces"] and fragments.closed.all()
    mass, moment = 0.0, np.zeros((3, 3))
    for index in range(fragments.count):
        vertices, faces = fragments.piece(index)
        ours = mass_properties(vertices, faces, True, DENSITY, None)
        theirs = trimesh.Trimesh(vertices, faces, process=False)
        theirs.density = DENSITY
        assert theirs.is_watertight and theirs.is_winding_consistent and theirs.volume > 0
        assert ours.mass == pytest.approx(theirs.mass, rel=1e-9)
        assert ours.centre == pytest.approx(theirs.center_mass, abs=1e-9)
        scale = abs(theirs.moment_inertia).max()
        assert ours.inertia == pytest.approx(theirs.moment_inertia, abs=1e-6 * scale)
        mass += ours.mass
        moment += about_origin(ours.inertia, ours.mass, ours.centre)
    assert mass == pytest.approx(DENSITY * body.volumes.sum(), rel=1e-9)
    whole = mass_properties(body.vertices, body.surface()[0], True, DENSITY, None)
    expected = about_origin(whole.inertia, whole.mass, whole.centre)
    assert moment == pytest.approx(expected, abs=1e-9 * abs(expected).max())


def about_origin(inertia, mass, centre):
    """The parallel axis theorem."""
    return inertia + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
