"""A run as one animated USD stage: pieces that move, particles that come and go, the fire.

    /run/pieces/BODY_NNNN   Mesh at rest about its centre, with sampled translate and orient (a soft
                            body: sampled points)
    /run/SPECIES            Points, with temperature and mass as primvars
    /run/fire               Volume, where DIR holds the files of `--to vdb` for these frames

y is up, as in our scenes. One snapshot is one frame at 24 frames per second: programs keep that
rate whatever a stage says.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partition import fragments
from solver.files import Snapshot
from solver.results.pose import moments, posed, shape_at_rest

NAME = "run.usdc"
RATE = 24.0
PARTICLE_SIZE = 0.005   # of the box that the particles span


def write(run: Path, output: Path, frames: Sequence[int]) -> list[Path]:
    """Write run.usdc; returns it."""
    from pxr import Usd, UsdGeom

    snapshots = moments(run, frames)
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(RATE)
    stage.SetFramesPerSecond(RATE)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(len(frames) - 1)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/run").GetPrim())
    if snapshots[0].bodies:
        _pieces(stage, fragments.read(run / "fragments.h5"), snapshots)
    for species in snapshots[0].particles:
        _particles(stage, species, [snapshot.particles[species] for snapshot in snapshots])
    volumes = [output / f"fields_{frame:06d}.vdb" for frame in frames]
    if all(path.is_file() for path in volumes):
        _fire(stage, [path.name for path in volumes])
    path = output / NAME
    stage.GetRootLayer().Export(str(path))
    return [path]


def _pieces(stage: Any, found: fragments.Fragments, snapshots: Sequence[Snapshot]) -> None:
    from pxr import Gf, UsdGeom

    UsdGeom.Xform.Define(stage, "/run/pieces")   # Blender leaves out what has no type
    soft = "vertices" in snapshots[0].bodies
    places = [posed(found, snapshot.bodies) for snapshot in snapshots] if soft else []
    rest = shape_at_rest(found, snapshots[0].bodies)
    for index in range(found.count):
        rows = slice(*found.vertex_start[index:index + 2])
        faces = found.piece(index)[1]
        name = f"{_identifier(found.names[found.body[index]])}_{index:04d}"
        mesh = UsdGeom.Mesh.Define(stage, f"/run/pieces/{name}")
        mesh.CreateFaceVertexCountsAttr(np.full(len(faces), 3, np.int32))
        mesh.CreateFaceVertexIndicesAttr(faces.astype(np.int32).ravel())
        mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
        points = mesh.CreatePointsAttr()
        if soft:
            for code, place in enumerate(places):
                points.Set(place[rows].astype(np.float32), code)
            continue
        points.Set((rest[rows] - snapshots[0].bodies["rest_centre"][index]).astype(np.float32))
        move, turn = mesh.AddTranslateOp(), mesh.AddOrientOp()
        for code, snapshot in enumerate(snapshots):
            bodies = snapshot.bodies
            move.Set(Gf.Vec3d(*map(float, bodies["position"][index])), code)
            turn.Set(Gf.Quatf(*map(float, bodies["orientation"][index])), code)


def _particles(stage: Any, species: str, tables: Sequence[Mapping[str, NDArray[Any]]]) -> None:
    from pxr import Sdf, UsdGeom

    cloud = UsdGeom.Points.Define(stage, f"/run/{species}")
    points, ids, widths = (cloud.CreatePointsAttr(), cloud.CreateIdsAttr(),
                           cloud.CreateWidthsAttr())
    interface = UsdGeom.PrimvarsAPI(cloud)
    extra = {name: interface.CreatePrimvar(name, Sdf.ValueTypeNames.FloatArray,
                                           UsdGeom.Tokens.vertex)
             for name in ("temperature", "mass") if name in tables[0]}
    spans = [np.ptp(table["position"], axis=0).max() for table in tables if len(table["position"])]
    cloud.SetWidthsInterpolation(UsdGeom.Tokens.constant)
    widths.Set([float(PARTICLE_SIZE * max(spans, default=1.0))])
    for code, table in enumerate(tables):
        points.Set(table["position"].astype(np.float32), code)
        ids.Set(table["id"].astype(np.int64), code)
        for name, primvar in extra.items():
            primvar.Set(table[name].astype(np.float32), code)


def _fire(stage: Any, names: Sequence[str]) -> None:
    from pxr import Sdf, UsdVol

    volume = UsdVol.Volume.Define(stage, "/run/fire")
    asset = UsdVol.OpenVDBAsset.Define(stage, "/run/fire/temperature")
    asset.CreateFieldNameAttr("temperature")
    path = asset.CreateFilePathAttr()
    for code, name in enumerate(names):
        path.Set(Sdf.AssetPath(f"./{name}"), code)
    volume.CreateFieldRelationship("temperature", asset.GetPath())


def _identifier(name: str) -> str:
    from pxr import Tf

    return str(Tf.MakeValidIdentifier(name))
