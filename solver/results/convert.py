"""Which programs can a run be converted for?

    usd      one animated stage: pieces, particles, and where there are VDB files the fire (Blender,
             Houdini, usdview)
    vdb      one OpenVDB file per frame: every field of the cells (Blender, Houdini)
    glb      one glTF file per frame: the pieces (browsers, PowerPoint)
    vtkhdf   cells, particles of each species, pieces: one file each, with all times (VTK, ParaView)
    xdmf     an index of the snapshots where they are (ParaView, VisIt)
    csv      particles and pieces of each frame, budgets of the steps (spreadsheets)
"""

from collections.abc import Callable, Sequence
from pathlib import Path

from solver.files import FileError
from solver.results import to_csv, to_glb, to_usd, to_vdb, to_vtkhdf, to_xdmf

FORMATS: dict[str, Callable[[Path, Path, Sequence[int]], list[Path]]] = {
    "usd": to_usd.write, "vdb": to_vdb.write, "glb": to_glb.write, "vtkhdf": to_vtkhdf.write,
    "xdmf": to_xdmf.write, "csv": to_csv.write}
OWN = ("snapshots", "checkpoints")


def check_target(run: Path, output: Path) -> None:
    """Refuse to write among the run's own files; raises `FileError`."""
    if output.exists() and not output.is_dir():
        raise FileError(f"-o {output}: is a file; fix: give a folder")
    for name in OWN:
        own = (run / name).resolve()
        if own == output.resolve() or own in output.resolve().parents:
            raise FileError(f"-o {output}: holds the run itself; fix: give another folder")
    output.mkdir(parents=True, exist_ok=True)
