"""Other programs open what we write, with values and axes right. Runs in .venv-ecosystem:

    bash tests/run.sh --ecosystem

The run is made by the solver of .venv. T = x + 10 y + 100 z at the start, on cells that are not
cubes, so that no exchange of axes and no shift goes unseen.
"""

import csv
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

REASON = "needs bash runs/setup_ecosystem.sh, and tests/run.sh --ecosystem to start it there"
for _module in ("openpmd_viewer", "pyvista", "xarray", "pandas", "pxr", "trimesh"):
    pytest.importorskip(_module, reason=REASON)

import pyvista  # noqa: E402
import trimesh  # noqa: E402
import vtk  # noqa: E402
from openpmd_viewer import OpenPMDTimeSeries  # noqa: E402
from pxr import Usd, UsdGeom, UsdVol  # noqa: E402
from vtk.util.numpy_support import vtk_to_numpy  # noqa: E402

from solver.files import read_snapshot  # noqa: E402
from solver.results.pose import posed  # noqa: E402
from solver.results.reading import Run  # noqa: E402

pytestmark = [pytest.mark.serial, pytest.mark.filterwarnings("default")]

ROOT = Path(__file__).resolve().parent.parent
CELLS, SPACING = np.array([8, 6, 5]), np.array([0.1, 0.2, 0.4])
SCENE = """
[domain]
cells = [8, 6, 5]
size = [0.8, 1.2, 2.0]
[time]
end = 0.03
frame = 0.01
[initial]
T = "x + 10*y + 100*z"
u = "y"
v = "z"
w = "x"
[detonation]
position = [0.4, 0.6, 1.0]
[fuel]
particles = 40
ignited = 5
rate = 2000.0
mass = 1e-4
[soot]
[output]
precision = "float64"
[[body]]
name = "pane"
shape = "pane"
size = [0.4, 0.4, 0.02]
place = [0.4, 0.6, 1.5]
points = 20
areal_density = 1.0
force = 30.0
velocity = [1.0, 2.0, 3.0]
spin = [5.0, 7.0, 9.0]
fracture = { method = "bfs", pieces = 3 }
"""


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    (folder / "scene.toml").write_text(SCENE)
    for arguments in (["partition", folder / "scene.toml", "-o", folder / "out/fragments.h5"],
                      ["solver", folder / "scene.toml", "-o", folder / "out"]):
        subprocess.run([ROOT / ".venv/bin/python", "-m", *arguments], check=True, cwd=ROOT)
    return folder / "out"


@pytest.fixture(scope="module")
def converted(out, tmp_path_factory):
    """Every format that `convert` knows, in one folder."""
    folder = tmp_path_factory.mktemp("converted")
    for kind in ("vdb", "usd", "glb", "vtkhdf", "xdmf", "csv"):
        subprocess.run([sys.executable, "-m", "solver.results", "convert", out, "--to", kind, "-o",
                        folder], check=True, cwd=ROOT)
    return folder


def expected_temperature(x, y, z):
    return x + 10 * y + 100 * z


def centres():
    return [(np.arange(n) + 0.5) * h for n, h in zip(CELLS, SPACING, strict=True)]


def pieces_at(out, frame):
    run = Run(out)
    return posed(run.fragments, read_snapshot(out, frame, ()).bodies)


def test_the_validator_of_openpmd_reports_no_error(out):
    for path in sorted((out / "snapshots").glob("*.h5")):
        said = subprocess.run([Path(sys.executable).parent / "openPMD_check_h5", "-i", path],
                              capture_output=True, text=True)
        assert "Result: 0 Errors" in said.stdout, said.stdout + said.stderr


def test_openpmd_viewer_sees_fields_on_their_places(out):
    series = OpenPMDTimeSeries(str(out / "snapshots"), check_all_files=True)
    assert list(series.iterations) == [0, 1, 2, 3] and np.allclose(series.t, [0, 0.01, 0.02, 0.03])
    x, y, z = centres()
    values, info = series.get_field("T", iteration=0)
    order = [info.axes[number] for number in range(3)]
    at = np.meshgrid(*(getattr(info, axis) for axis in order), indexing="ij")
    place = dict(zip(order, at, strict=True))
    assert np.allclose(info.x, x) and np.allclose(info.y, y) and np.allclose(info.z, z)
    assert np.allclose(values, expected_temperature(place["x"], place["y"], place["z"]))
    u, info = series.get_field("u", iteration=0)
    assert len(info.x) == 9 and np.allclose(info.x[[0, -1]], [0, 0.8]) and np.allclose(info.y, y)
    assert u.size == 9 * 6 * 5


def test_openpmd_viewer_sees_the_particles(out):
    series = OpenPMDTimeSeries(str(out / "snapshots"))
    for frame in (0, 3):
        ours = read_snapshot(out, frame, ()).particles["fuel"]
        x, y, z, mass = series.get_particle(["x", "y", "z", "mass"], species="fuel",
                                            iteration=frame)
        assert np.array_equal(np.column_stack([x, y, z]), ours["position"])
        assert np.array_equal(mass, ours["mass"]) and len(x) > 0


def assert_cells(image, frame, out):
    """A VTK image holds the fields of a frame where they are."""
    assert image.GetDimensions() == tuple(CELLS + 1)
    assert np.allclose(image.GetSpacing(), SPACING) and np.allclose(image.GetOrigin(), 0)
    stored = vtk_to_numpy(image.GetCellData().GetArray("T"))
    assert np.array_equal(stored, read_snapshot(out, frame).fields["T"].values.ravel())


def test_vtk_opens_a_snapshot_as_an_image(out):
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(out / "snapshots/snap_000000.h5"))
    reader.Update()
    image = reader.GetOutputDataObject(0)
    assert_cells(image, 0, out)
    values = pyvista.wrap(image)
    x, y, z = values.cell_centers().points.T
    assert np.allclose(values["T"], expected_temperature(x, y, z))


def vtkhdf_steps(path):
    """The data of every time of a file."""
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    for step in range(reader.GetNumberOfSteps()):
        reader.SetStep(step)
        reader.Modified()
        reader.Update()
        data = vtk.vtkImageData() if "cells" in path.name else vtk.vtkPolyData()
        data.DeepCopy(reader.GetOutputDataObject(0))
        yield step, pyvista.wrap(data)


def test_vtk_opens_all_times_of_the_cells(out, converted):
    steps = dict(vtkhdf_steps(converted / "cells.vtkhdf"))
    assert sorted(steps) == [0, 1, 2, 3]
    for frame, image in steps.items():
        assert_cells(image, frame, out)


def test_vtk_opens_all_times_of_the_particles(out, converted):
    counts = []
    for frame, cloud in vtkhdf_steps(converted / "fuel.vtkhdf"):
        ours = read_snapshot(out, frame, ()).particles["fuel"]
        assert np.allclose(cloud.points, ours["position"], atol=1e-6)
        assert np.array_equal(cloud["mass"], ours["mass"])
        assert cloud.n_verts == cloud.n_points
        counts.append(cloud.n_points)
    assert len(set(counts)) > 1   # their number changes


def test_vtk_opens_all_times_of_the_pieces(out, converted):
    for frame, surface in vtkhdf_steps(converted / "pieces.vtkhdf"):
        assert np.allclose(surface.points, pieces_at(out, frame), atol=1e-6)
        assert np.array_equal(np.unique(surface.cell_data["piece"]), [0, 1, 2])
        assert surface.n_cells == len(Run(out).fragments.faces)


@pytest.mark.parametrize("where", ["out", "converted"])
def test_paraviews_xdmf_reader_opens_cells_faces_and_particles(where, request, out):
    reader = pyvista.get_reader(request.getfixturevalue(where) / "run.xdmf")
    assert np.allclose(reader.time_values, [0, 0.01, 0.02, 0.03])
    reader.set_active_time_value(0.02)
    found = reader.read()   # the reader adds the number of the time to a name
    blocks = {name.split("[")[0]: found[name] for name in found.keys()}
    assert sorted(blocks) == ["cells", "faces of u", "faces of v", "faces of w", "fuel"]
    stored = read_snapshot(out, 2)
    assert np.array_equal(blocks["cells"]["T"], stored.fields["T"].values.ravel())
    assert np.allclose(blocks["cells"].bounds, [0, 0.8, 0, 1.2, 0, 2.0])
    faces = blocks["faces of v"]
    assert np.array_equal(faces["v"], stored.fields["v"].values.ravel())
    assert np.allclose(faces.bounds, [0.05, 0.75, 0, 1.2, 0.2, 1.8])
    assert np.array_equal(blocks["fuel"].points, stored.particles["fuel"]["position"])


def test_xarray_has_each_field_on_its_own_axes_and_reads_late(out):
    fields = Run(out).fields()
    assert fields["u"].dims == ("time", "z", "y", "x_u") and fields.sizes["x_u"] == 9
    first = fields["T"].isel(time=0)
    exact = expected_temperature(first.x, first.y, first.z)
    assert np.allclose(first, exact.transpose(*first.dims))
    at = fields["T"].sel(time=0.02, x=0.25, y=0.5, z=1.0, method="nearest")
    assert at.item() == read_snapshot(out, 2).fields["T"].values[2, 2, 2]
    assert not fields["p"].variable._in_memory
    part = fields["w"].isel(time=[1, 3], z_w=slice(None, None, 2), x=[0, 5])
    whole = [read_snapshot(out, frame).fields["w"].values for frame in (1, 3)]
    assert np.array_equal(part, np.stack(whole)[:, ::2, :, :][..., [0, 5]])


def test_pandas_has_particles_pieces_and_budgets(out):
    run = Run(out)
    table = run.particles(3)
    ours = read_snapshot(out, 3, ()).particles["fuel"]
    order = np.argsort(ours["id"])
    assert np.array_equal(table[["x", "y", "z"]], ours["position"][order])
    assert np.array_equal(table.index, ours["id"][order])
    budgets = run.budgets()
    lines = [json.loads(line) for line in (out / "run.log.jsonl").read_text().splitlines()]
    assert list(budgets.index) == [line["step"] for line in lines]
    assert budgets["burnt"].iloc[-1] == lines[-1]["burnt"] > 0
    pieces = run.bodies()
    assert len(pieces) == 4 * 3 and pieces.xs(2, level="frame")["time"].eq(run.times[2]).all()


def test_pyvista_has_the_pieces_in_their_places(out):
    blocks = Run(out).pieces(3)
    points = np.concatenate([blocks[index].points for index in range(blocks.n_blocks)])
    assert list(blocks.keys()) == ["pane 0", "pane 1", "pane 2"]
    assert np.allclose(points, pieces_at(out, 3))


def test_usd_moves_the_pieces_and_lets_particles_come_and_go(out, converted):
    stage = Usd.Stage.Open(str(converted / "run.usdc"))
    assert UsdGeom.GetStageUpAxis(stage) == "Y" and stage.GetEndTimeCode() == 3
    meshes = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    for frame in range(4):
        world = []
        for prim in meshes:
            matrix = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(frame))
            local = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(frame))
            world.append((np.column_stack([local, np.ones(len(local))]) @ matrix)[:, :3])
        assert np.allclose(np.concatenate(world), pieces_at(out, frame), atol=1e-6)
        cloud = UsdGeom.Points.Get(stage, "/run/fuel")
        ours = read_snapshot(out, frame, ()).particles["fuel"]
        assert np.allclose(cloud.GetPointsAttr().Get(frame), ours["position"], atol=1e-6)
        file = UsdVol.OpenVDBAsset.Get(stage, "/run/fire/temperature").GetFilePathAttr().Get(frame)
        assert Path(file.resolvedPath) == converted / f"fields_{frame:06d}.vdb"


def test_openvdb_has_the_values_where_they_are(out, converted):
    openvdb = pytest.importorskip("pyopenvdb", reason="needs python3-openvdb from apt")
    grids, _ = openvdb.readAll(str(converted / "fields_000000.vdb"))
    grid = next(grid for grid in grids if grid.name == "temperature")
    field = read_snapshot(out, 0).fields["T"].values
    for i, j, k in ((0, 0, 0), (7, 5, 4), (3, 1, 2)):
        value = grid.getConstAccessor().getValue((i, j, k)) + grid["offset"]
        assert value == pytest.approx(field[k, j, i], rel=1e-6)
        assert np.allclose(grid.transform.indexToWorld((i, j, k)), SPACING * ([i, j, k] + np.ones(3)
                                                                              / 2))


def test_gltf_has_the_pieces(out, converted):
    scene = trimesh.load_scene(converted / "pieces_000003.glb")
    places = pieces_at(out, 3)
    assert sorted(scene.geometry) == ["pane_0000", "pane_0001", "pane_0002"]
    assert np.allclose(scene.bounds, [places.min(axis=0), places.max(axis=0)], atol=1e-6)


def test_tables_of_text_hold_every_digit(out, converted):
    with open(converted / "fuel_000003.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    ours = read_snapshot(out, 3, ()).particles["fuel"]
    assert [float(row["y"]) for row in rows] == ours["position"][:, 1].tolist()
    assert [int(row["id"]) for row in rows] == ours["id"].tolist()
    with open(converted / "budgets.csv", newline="", encoding="utf-8") as file:
        assert len(list(csv.DictReader(file))) == len(Run(out).budgets())


@pytest.mark.parametrize("name", ["budgets", "hot_cloud", "thrown"])
def test_the_examples_of_analysis_draw_their_picture(out, tmp_path, name):
    picture = tmp_path / "picture.png"
    subprocess.run([sys.executable, "-W", "error::FutureWarning", "-m", f"runs.analysis.{name}",
                    out, picture], check=True, cwd=ROOT)
    shown = pyvista.read_texture(picture).to_array()
    assert shown.shape[1] > 500 and len(np.unique(shown.reshape(-1, shown.shape[2]), axis=0)) > 10


BLENDER = """
import json, sys
import bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.wm.usd_import(filepath=sys.argv[1])
result = {}
for frame in range(4):
    bpy.context.scene.frame_set(frame)
    graph = bpy.context.evaluated_depsgraph_get()
    for item in bpy.data.objects:
        if item.type == "MESH":
            whole = item.evaluated_get(graph)
            result.setdefault(item.name, []).append(
                [list(whole.matrix_world @ corner.co) for corner in whole.data.vertices])
kinds = sorted({item.type for item in bpy.data.objects})
for item in bpy.data.volumes:
    item.grids.load()
volumes = [[grid.name for grid in item.grids] for item in bpy.data.volumes]
print("RESULT" + json.dumps([result, kinds, volumes]))
"""


def test_blender_opens_the_stage_and_its_fire(out, converted):
    pytest.importorskip("bpy", reason="needs Blender's module bpy")
    said = subprocess.run([sys.executable, "-c", BLENDER, converted / "run.usdc"],
                          capture_output=True, text=True, timeout=200)
    line = next((line for line in said.stdout.splitlines() if line.startswith("RESULT")), None)
    assert line, said.stdout + said.stderr
    meshes, kinds, volumes = json.loads(line[6:])
    assert "VOLUME" in kinds and volumes and "temperature" in volumes[0]
    names = sorted(name for name in meshes if name.startswith("pane"))
    assert len(names) == 3
    for frame in range(4):
        seen = np.concatenate([np.array(meshes[name][frame]) for name in names])
        # Blender is z-up: (x, y, z) of ours stands at (x, -z, y) there
        assert np.allclose(np.column_stack([seen[:, 0], seen[:, 2], -seen[:, 1]]),
                           pieces_at(out, frame), atol=1e-5)
