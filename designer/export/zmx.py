"""Zemax OpticStudio's text format (``.zmx``), sequential mode: a file for each view.

The system is that of :mod:`designer.export.sequential`. Thicknesses are differences of heights along +z and so change
their sign after each mirror; curvatures keep theirs, because OpticStudio's local axes do not turn at a mirror. A
coordinate break at the effective viewpoint moves the axes out to the wall and turns them by 90 degrees about x. The
shift alone decides where the wall stands, so programs that count this angle in the other sense find it in the same
place. The sense of the angle keeps OpticStudio's rule that light runs along local -z after an odd number of mirrors.
"""

from __future__ import annotations

import math

from designer.design import Design, Mirror
from designer.export.sequential import WAVELENGTH_UM, SequentialView, sequential_views
from designer.files import InputError

# From here on OpticStudio takes a thickness as infinite.
LARGEST_MM = 1e10


def zmx_files(design: Design) -> dict[str, str]:
    """The file of each view, by the view's name.

    Raises
    ------
    InputError
        No ray of the image leaves a view's mirrors at an elevation that it must see, or a length is beyond what
        OpticStudio reads.
    """
    return {name: _file(view) for name, view in sequential_views(design).items()}


def _file(view: SequentialView) -> str:
    lines = [
        "VERS 200000 0 0",
        "MODE SEQ",
        f"NAME {_ascii(view.title)}",
        *(f"NOTE 0 {_ascii(line)}" for line in view.notes),
        "UNIT MM X W X CM MR CPMM",
        f"ENPD {_number(view.pupil_diameter_mm)}",
        f"FTYP 1 0 {len(view.sensor_heights_mm)} 1 0 0 0",
        f"XFLN {' '.join('0' for _ in view.sensor_heights_mm)}",
        f"YFLN {' '.join(map(_number, view.sensor_heights_mm))}",
        f"FWGN {' '.join('1' for _ in view.sensor_heights_mm)}",
        f"WAVM 1 {_number(WAVELENGTH_UM)} 1",
        "PWAV 1",
    ]
    heights = [mirror.vertex_mm for mirror in view.mirrors] + [view.viewpoint_mm]
    surfaces = [
        _surface("sensor", view.principal_distance_mm),
        _surface(
            "lens, entrance pupil",
            heights[0],
            kind="PARAXIAL",
            stop=True,
            lines=[
                f"PARM 1 {_number(view.lens_focal_length_mm)}",
                "PARM 2 1",
                f'DIAM {_number(view.pupil_diameter_mm / 2.0)} 1 0 0 1 ""',
            ],
        ),
        *(
            _mirror(mirror, following - mirror.vertex_mm)
            for mirror, following in zip(view.mirrors, heights[1:], strict=True)
        ),
        _surface(
            "effective viewpoint, axes moved to the wall",
            0.0,
            kind="COORDBRK",
            lines=[f"PARM 2 {_number(view.wall_mm)}", f"PARM 3 {90.0 if len(view.mirrors) % 2 else -90.0}"],
        ),
        _surface("wall in the scene", 0.0),
    ]
    for index, surface in enumerate(surfaces):
        lines += [f"SURF {index}", *(f"  {line}" for line in surface)]
    # OpticStudio is a Windows program.
    return "\r\n".join([*lines, ""])


def _surface(
    comment: str,
    thickness_mm: float,
    *,
    kind: str = "STANDARD",
    curvature: float = 0.0,
    stop: bool = False,
    lines: list[str] | None = None,
) -> list[str]:
    return [
        f"TYPE {kind}",
        *(["STOP"] if stop else []),
        f'CURV {_number(curvature)} 0 0 0 0 ""',
        f"COMM {_ascii(comment)}",
        f"DISZ {_number(thickness_mm)}",
        *(lines or []),
    ]


def _mirror(mirror: Mirror, thickness_mm: float) -> list[str]:
    inner, outer = _number(mirror.inner_radius_mm), _number(mirror.outer_radius_mm)
    return _surface(
        f"{mirror.name} mirror",
        thickness_mm,
        curvature=0.0 if mirror.radius_mm is None else 1.0 / mirror.radius_mm,
        lines=[
            "GLAS MIRROR 0 0 1.5 40.0 0 0 0 0 0 0",
            f"CONI {_number(mirror.conic)}",
            f'DIAM {outer} 1 0 0 1 ""',
            f"CLAP {inner} {outer} 0",
        ],
    )


def _number(value: float) -> str:
    """A number with the seventeen digits that give it back exactly."""
    if not math.isfinite(value) or abs(value) >= LARGEST_MM:
        raise InputError(f"{value:g}: beyond what OpticStudio reads (less than {LARGEST_MM:g} mm)")
    return f"{value:.16E}"


def _ascii(text: str) -> str:
    """Text on one line; letters that older versions do not read as their code."""
    return " ".join(text.split()).encode("ascii", "backslashreplace").decode("ascii")
