"""The parameters of the picture: camera, lights, materials, volume and colour."""

from solver.schema import Section, parameter


class Render(Section):
    """The [render] table; a scene without it is not filmed."""

    width: int = parameter(300, "image width", "px", ge=1, le=16384)
    height: int = parameter(300, "image height", "px", ge=1, le=16384)
