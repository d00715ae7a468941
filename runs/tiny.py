"""A scene at smoke-test size: every part of it still runs, in seconds instead of minutes."""

from collections.abc import Iterator

from solver.scene import Scene

CELLS = 16        # along the longest edge
FRAMES = 3        # after the first
PARTICLES = 500
PIXELS = 64       # along the longer edge
POINTS = 60       # of a pane
PIECES = 6        # of a body


def overrides(scene: Scene) -> Iterator[str]:
    """What to change in the scene, as `section.key=value`; nothing is made larger."""
    cells = _shrunk(scene.domain.cells, CELLS, least=4)
    yield f"domain.cells={cells}"
    yield f"time.end={min(scene.time.end, FRAMES * scene.time.frame)!r}"
    if scene.fuel is not None:
        ignited, particles = _shrunk((scene.fuel.ignited, scene.fuel.particles), PARTICLES, least=0)
        yield f"fuel.particles={particles}"
        yield f"fuel.ignited={ignited}"
    for index, body in enumerate(scene.body):
        yield f"body.{index}.points={min(body.points, POINTS)}"
        if body.fracture is not None:
            yield f"body.{index}.fracture.pieces={min(body.fracture.pieces, PIECES)}"
    if scene.render is not None:
        width, height = _shrunk((scene.render.width, scene.render.height), PIXELS, least=1)
        yield f"render.width={width}"
        yield f"render.height={height}"


def _shrunk(numbers: tuple[int, ...], most: int, least: int) -> list[int]:
    """The numbers in proportion, the largest at most `most`, none below `least` that was above."""
    factor = min(1.0, most / max(*numbers, 1))
    return [max(round(number * factor), min(number, least)) for number in numbers]
