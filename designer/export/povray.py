"""A POV-Ray scene (``.pov``): every mirror as an exact quadric, seen by a pinhole camera in the design's pinhole.

POV-Ray's scene uses the designer's own frame and millimetres: its camera is given by vectors, so that its image is
that of the designer, x right and y down, and pixel centres lie where the designer has them. A quadric is both sheets of
a conic; what is clipped away leaves the used zone of the vertex sheet.
"""

from __future__ import annotations

import math

from designer.design import Camera, Design, Mirror
from designer.export.housing_words import without_the_housing
from designer.export.sequential import refuse_other_laws
from designer.files import InputError
from designer.trace.instrument import sag

# How far the clip reaches beyond the face along the axis: more than POV-Ray's tolerance, less than to another sheet.
_CLIP_MARGIN_MM = 1.0
# The camera body has no end below; nothing sees this far down.
_BODY_LENGTH_MM = 1e4
# POV-Ray takes hits closer than its tolerance for none.
LARGEST_MM = 1e6


def povray_scene(design: Design) -> dict[str, str]:
    """The scene, by the design's configuration.

    Raises
    ------
    InputError
        The lens is not perspective, a length is beyond what POV-Ray resolves, or there is no distance for the wall.
    """
    refuse_other_laws(design.camera, "the scene's camera is a pinhole before a flat image plane")
    lines = [*_head(design), *_camera(design.camera)]
    for mirror in design.mirrors:
        lines += _mirror(mirror)
    return {design.configuration: "\n".join([*lines, *_camera_body(design.camera), *_wall(design), ""])}


def _head(design: Design) -> list[str]:
    camera = design.camera
    return [
        f"// {' '.join(design.configuration.split())}: all lengths in mm, origin at the pinhole, z up along the axis.",
        f"// povray +I<this file> +W{camera.width_px} +H{camera.height_px} +A0.1",
        "// The camera is a pinhole: the lens's focus and the light that its pupil loses are not in this scene.",
        *(f"// {sentence}" for sentence in without_the_housing(design)),
        "// Put a scene of your own in the place of the wall at the end.",
        "#version 3.7;",
        "global_settings { assumed_gamma 1.0 max_trace_level 12 }",
        "#declare Reflecting = texture { pigment { rgb 0 } finish { ambient 0 diffuse 0 emission 0 reflection 1 } }",
        "#declare Black = texture { pigment { rgb 0 } finish { ambient 0 diffuse 0 emission 0 reflection 0 } }",
        "",
    ]


def _camera(camera: Camera) -> list[str]:
    across, down = (_number(count * camera.pixel_pitch_mm) for count in (camera.width_px, camera.height_px))
    return [
        "// Distance to the image plane and size of the sensor; y points down in the image.",
        "camera {",
        "  perspective",
        "  location <0, 0, 0>",
        f"  direction <0, 0, {_number(camera.focal_length_mm)}>",
        f"  right <{across}, 0, 0>",
        f"  up <0, -{down}, 0>",
        "}",
        "",
    ]


def _mirror(mirror: Mirror) -> list[str]:
    """Face, reflecting on its own side only, and the back and edges of the substrate."""
    name = " ".join(mirror.name.split())
    title = f"// {name} mirror: {mirror.kind}, R = {mirror.radius_mm} mm, K = {mirror.conic!r}, faces {mirror.faces}"
    back = mirror.vertex_mm + mirror.back_offset_mm
    lines = [title, *_face(mirror, mirror.vertex_mm, "texture { Reflecting } interior_texture { Black }")]
    if mirror.thickness_mm > 0.0:
        lines += _face(mirror, back, "texture { Black }")
        for radius in (mirror.outer_radius_mm, mirror.inner_radius_mm):
            if radius > 0.0:
                rim = float(sag(mirror, radius))
                low, high = sorted((mirror.vertex_mm + rim, back + rim))
                lines.append(f"{_tube(radius, low, high)} open texture {{ Black }} }}")
    return [*lines, ""]


def _face(mirror: Mirror, vertex_mm: float, textures: str) -> list[str]:
    """The conic c (x^2 + y^2 + (1 + K) z^2) - 2 z = 0, z from the vertex; its outside is the reflecting side."""
    side = 1.0 if mirror.faces == "down" else -1.0
    curvature = 0.0 if mirror.radius_mm is None else side / mirror.radius_mm
    squares = ", ".join(_number(value) for value in (curvature, curvature, curvature * (1.0 + mirror.conic)))
    low, high = _clip_heights(mirror)
    outer = f"{_tube(mirror.outer_radius_mm, low, high)} }}"
    clip = outer
    if mirror.inner_radius_mm > 0.0:
        hole = f"{_tube(mirror.inner_radius_mm, low - _CLIP_MARGIN_MM, high + _CLIP_MARGIN_MM)} }}"
        clip = f"difference {{ {outer} {hole} }}"
    return [
        "quadric {",
        f"  <{squares}>, <0, 0, 0>, <0, 0, {_number(-2.0 * side)}>, 0",
        f"  clipped_by {{ {clip} }}",
        f"  {textures}",
        f"  translate <0, 0, {_number(vertex_mm)}>",
        "}",
    ]


def _clip_heights(mirror: Mirror) -> tuple[float, float]:
    """Heights from the vertex between which the face lies, and nothing of the other sheet or half of the conic."""
    rims = [float(sag(mirror, radius)) for radius in (mirror.inner_radius_mm, mirror.outer_radius_mm)]
    low, high = min(rims) - _CLIP_MARGIN_MM, max(rims) + _CLIP_MARGIN_MM
    if mirror.radius_mm is not None and mirror.conic != -1.0:
        middle = mirror.radius_mm / (1.0 + mirror.conic)
        if middle > max(rims):
            high = min(high, (max(rims) + middle) / 2.0)
        else:
            low = max(low, (min(rims) + middle) / 2.0)
    return low, high


def _camera_body(camera: Camera) -> list[str]:
    """Barrel and body; the camera looks out of them, so it sees them in mirrors only (no_image)."""
    seat, front = camera.lens_seat_mm, camera.lens_front_mm
    barrel, body = camera.lens_radius_mm, camera.body_radius_mm
    rest = "texture { Black } no_image }"
    lines = [
        "// Lens barrel and camera body.",
        f"disc {{ <0, 0, {_number(front)}>, <0, 0, 1>, {_number(barrel)} {rest}",
    ]
    if camera.lens_length_mm > 0.0:
        lines.append(f"{_tube(barrel, seat, front)} open {rest}")
    if body > 0.0:
        lines.append(f"{_tube(body, seat - _BODY_LENGTH_MM, seat)} open {rest}")
    if body > barrel:
        lines.append(f"disc {{ <0, 0, {_number(seat)}>, <0, 0, 1>, {_number(body)}, {_number(barrel)} {rest}")
    return [*lines, ""]


def _wall(design: Design) -> list[str]:
    """A chequered round wall at the geometric mean of the working distances, a tenth of that to a square."""
    near, far = design.working_volume.distance_mm
    if not 0.0 < near <= far:
        raise InputError(f"working_volume.distance_mm: must be above 0 and increasing, not {near:g} to {far:g}")
    distance = math.sqrt(near) * math.sqrt(far)
    middle = design.views.middle_mm
    steepest = max(abs(each) for view in design.views.by_name.values() for each in view.elevation_deg)
    reach = distance * math.tan(math.radians(min(steepest, 85.0))) + distance
    square = _number(distance / 10.0)
    return [
        f"// Wall at {distance:.6g} mm from the axis.",
        f"{_tube(distance, middle - reach, middle + reach)} open",
        f"  pigment {{ checker rgb 0.2, rgb 0.9 scale {square} translate <0, 0, {_number(middle)}> }}",
        "  finish { ambient 0 diffuse 0 emission 1 }",
        "}",
    ]


def _tube(radius_mm: float, low_mm: float, high_mm: float) -> str:
    """A cylinder about the axis, to be closed by the caller."""
    return f"cylinder {{ <0, 0, {_number(low_mm)}>, <0, 0, {_number(high_mm)}>, {_number(radius_mm)}"


def _number(value: float) -> str:
    if not abs(value) <= LARGEST_MM:
        raise InputError(f"{value:g}: beyond what POV-Ray resolves (at most {LARGEST_MM:g} mm)")
    return repr(value)
