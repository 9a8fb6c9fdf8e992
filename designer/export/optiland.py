"""Optiland's own format (``.json``): a file for each view, for ``optiland.fileio.load_optiland_file``.

The system is that of :mod:`designer.export.sequential`. Optiland places surfaces in world coordinates, which here are
the designer's: the lens stands at z = 0, the sensor below it. The wall is turned by 90 degrees about x: its own y
points up. A file is written without optiland, in the layout of its version 0.6.
"""

from __future__ import annotations

import json
import math

from pydantic import JsonValue

from designer.design import Design, Mirror
from designer.export.sequential import WAVELENGTH_UM, SequentialView, sequential_views

Table = dict[str, JsonValue]


def optiland_files(design: Design) -> dict[str, str]:
    """The file of each view, by the view's name.

    Raises
    ------
    InputError
        No ray of the image leaves a view's mirrors at an elevation that it must see.
    """
    # Optiland reads and writes a plane's radius as Infinity, which is no JSON, but Python's.
    return {name: json.dumps(_system(view), indent=2) + "\n" for name, view in sequential_views(design).items()}


def _system(view: SequentialView) -> Table:
    fields: list[JsonValue] = [
        {"x": 0.0, "y": height, "vx": 0.0, "vy": 0.0, "weight": 1.0} for height in view.sensor_heights_mm
    ]
    return {
        "version": 1.0,
        "name": " ".join([*view.notes]),
        "aperture": {"type": "EPD", "value": view.pupil_diameter_mm},
        "fields": {"fields": fields, "telecentric": False, "field_definition": {"field_type": "ObjectHeightField"}},
        "wavelengths": {
            "wavelengths": [{"value": WAVELENGTH_UM, "is_primary": True, "unit": "um", "weight": 1.0}],
            "polarization": "ignore",
        },
        "apodization": None,
        "pickups": [],
        "solves": {"solves": []},
        "surface_group": {"surfaces": _surfaces(view)},
        "ray_tracer": {"ray_aiming_config": {"mode": "paraxial", "max_iter": 10, "tol": 1e-06}},
    }


def _surfaces(view: SequentialView) -> list[JsonValue]:
    lens: Table = {
        "type": "ThinLensInteractionModel",
        "is_reflective": False,
        "focal_length": view.lens_focal_length_mm,
    }
    sensor: JsonValue = {
        "type": "ObjectSurface",
        "geometry": _plane(z=-view.principal_distance_mm),
        "material_post": _air(),
        "comment": "sensor",
    }
    return [
        sensor,
        _surface("lens, entrance pupil", _plane(), lens, is_stop=True),
        *(_mirror(mirror) for mirror in view.mirrors),
        _surface(
            "wall in the scene",
            _plane(y=view.wall_mm, z=view.viewpoint_mm, rx=math.pi / 2.0),
            {"type": "RefractiveReflectiveModel", "is_reflective": False},
        ),
    ]


def _mirror(mirror: Mirror) -> JsonValue:
    geometry: Table = (
        _plane(z=mirror.vertex_mm)
        if mirror.radius_mm is None
        else {
            "type": "StandardGeometry",
            "cs": _place(z=mirror.vertex_mm),
            "radius": mirror.radius_mm,
            "conic": mirror.conic,
        }
    )
    aperture: Table = {"type": "RadialAperture", "r_max": mirror.outer_radius_mm, "r_min": mirror.inner_radius_mm}
    interaction: Table = {"type": "RefractiveReflectiveModel", "is_reflective": True}
    return _surface(f"{mirror.name} mirror", geometry, interaction, aperture=aperture)


def _surface(
    comment: str,
    geometry: Table,
    interaction: Table,
    *,
    is_stop: bool = False,
    aperture: Table | None = None,
) -> JsonValue:
    return {
        "type": "Surface",
        "thickness": 0.0,
        "geometry": geometry,
        "material_post": _air(),
        "is_stop": is_stop,
        "aperture": aperture,
        "comment": comment,
        "interaction_model": interaction | {"coating": None, "bsdf": None},
    }


def _plane(y: float = 0.0, z: float = 0.0, rx: float = 0.0) -> Table:
    return {"type": "Plane", "cs": _place(y, z, rx), "radius": math.inf}


def _place(y: float = 0.0, z: float = 0.0, rx: float = 0.0) -> Table:
    return {"x": 0.0, "y": y, "z": z, "rx": rx, "ry": 0.0, "rz": 0.0, "reference_cs": None}


def _air() -> JsonValue:
    propagation: JsonValue = {"class": "HomogeneousPropagation"}
    return {"type": "IdealMaterial", "propagation_model": propagation, "index": 1.0, "absorp": 0.0}
