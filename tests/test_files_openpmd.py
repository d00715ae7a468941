"""A snapshot is openPMD and VTKHDF too: what their specifications ask for is there, as links."""

import h5py
import numpy as np
import pytest
from mpi4py import MPI

from solver import files
from solver import files_write
from solver.files import read_snapshot
from solver.files_checksum import check
from solver.snapshot import Snapshot
from tests.fire_case import running

COMM = MPI.COMM_WORLD
SCENE = {"domain": {"cells": [8, 6, 5], "size": (0.8, 1.2, 2.0)},
         "initial": {"T": "x + 10*y + 100*z", "u": "x*y"}, "fuel": {"particles": 50, "ignited": 5},
         "soot": {}}


@pytest.fixture(params=[0, 1 << 30], ids=["all ranks write", "rank 0 writes"])
def stored(shared_path, request, monkeypatch):
    monkeypatch.setattr(files_write, "PARALLEL_FROM", request.param)
    with running(**SCENE) as simulation:
        path = Snapshot(simulation.scene, simulation.state, shared_path).write(simulation.state, 3)
    COMM.Barrier()
    with h5py.File(path, "r") as file:
        yield file


def axes(record):
    """Coordinates of an openPMD mesh, one array per axis label."""
    names = [label.decode() for label in record.attrs["axisLabels"]]
    return {name: (np.arange(n) + shift) * h + start for name, n, shift, h, start in zip(
        names, record.shape, record.attrs["position"], record.attrs["gridSpacing"],
        record.attrs["gridGlobalOffset"], strict=True)}


def test_fields_stand_where_openpmd_says(stored):
    assert stored.attrs["openPMD"] == b"1.1.0" and stored.attrs["basePath"] == b"/data/%T/"
    meshes = stored[stored.attrs["basePath"].replace(b"%T", b"3") + stored.attrs["meshesPath"]]
    at = axes(meshes["T"])
    expected = (at["x"][None, None, :] + 10 * at["y"][None, :, None] + 100 * at["z"][:, None, None])
    np.testing.assert_allclose(meshes["T"][()], expected, rtol=1e-6)
    at = axes(meshes["u"])
    assert at["x"][[0, -1]] == pytest.approx([0, 0.8]) and meshes["u"].shape == (5, 6, 9)
    assert set(meshes) == set(stored["fields"]) and meshes["T"] == stored["fields/T"]
    for record in meshes.values():
        assert {"geometry", "dataOrder", "gridUnitSI", "unitSI", "unitDimension",
                "timeOffset"} <= record.attrs.keys()


def test_particles_are_views_of_ours(stored):
    species = stored["data/3/particles/fuel"]
    ours = stored["particles/fuel"]
    for column, axis in enumerate("xyz"):
        np.testing.assert_array_equal(species[f"position/{axis}"][()], ours["position"][:, column])
        assert species[f"position/{axis}"].is_virtual
        assert species[f"positionOffset/{axis}"].attrs["shape"] == [50]
    assert species["mass"] == ours["mass"]
    assert stored["data/3/particles/soot/position/x"].shape == (0,)


def test_vtk_finds_an_image_of_the_cells(stored):
    image = stored["VTKHDF"]
    assert image.attrs["Type"] == b"ImageData"
    assert list(image.attrs["WholeExtent"]) == [0, 8, 0, 6, 0, 5]
    np.testing.assert_allclose(image.attrs["Spacing"], [0.1, 0.2, 0.4])
    assert set(image["CellData"]) == {"p", "T", "phi"}
    assert image["CellData/T"] == stored["fields/T"]


def test_ours_reads_it_as_before(stored):
    directory = files.Path(stored.filename).parent.parent
    frame = read_snapshot(directory, 3)
    assert set(frame.fields) == set(stored["fields"]) and set(frame.particles) == {"fuel", "soot"}
    assert check(files.snapshot_path(directory, 3), files.SNAPSHOT) == ""
