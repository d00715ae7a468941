"""`python -m tests.flow_ranks FILE.npz`: 20 steps of a small window, all fields in float64."""

import sys

import numpy as np

from partition.build import build as break_up
from tests.flow_case import COMM, gathered, make_scene, simulation, velocity

SCENE = {
    "initial": {"noise": 1e-3},
    "fluid": {"cooling": 5.0, "buoyancy": 0.01, "vorticity_confinement": 0.1,
              "temperature_advection": "tvd", "advection": "tvd"},
    "detonation": {"position": [0.46, 0.52, 0.48]},
    "fuel": {"particles": 300, "ignited": 30, "rate": 5e4, "drag": 0.0},
    "soot": {"threshold": 1e-4},
    "time": {"integrator": "rk3", "end": 1.0, "frame": 1.0},
}
PANE = {"name": "pane", "shape": "pane", "size": [0.6, 0.5, 0.01], "place": [0.5, 0.5, 0.6],
        "points": 40, "areal_density": 20.0, "force": 30.0,
        "fracture": {"method": "bfs", "pieces": 8}}


def main() -> None:
    scene = make_scene((11, 9, 13), "open", size=(1.0, 0.9, 1.1), **SCENE)
    scene = type(scene).model_validate(scene.model_dump() | {"body": [PANE]})
    with simulation(scene, break_up(scene)) as sim:
        for _ in range(20):
            report = sim.advance(1.0)
        state = sim.state
        found = dict(zip("uvw", velocity(state), strict=True))
        for name in ("p", "T", "phi"):
            found[name] = gathered(state.grid, getattr(state, name))
        points = np.concatenate(COMM.allgather(np.array(state.swarm.points)))
        points = points[np.argsort(points["id"])]
        for column in ("id", "position", "temperature", "mass"):
            found[f"particle_{column}"] = points[column]
        for column in ("position", "orientation", "velocity", "spin"):
            found[f"body_{column}"] = getattr(state.bodies, column)
        found["counts"] = np.array([report.fuel, report.soot, report.burning])
        found["totals"] = np.array([report.burnt, report.gas, report.heat])
        found["time"] = np.array(state.time)
        if COMM.rank == 0:
            np.savez(sys.argv[1], **found)


if __name__ == "__main__":
    main()
