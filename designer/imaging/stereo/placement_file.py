"""Placement files: where the image of each view lies, in TOML.

``designer stereo`` writes the placements that it used, and reads them again with ``--placement``::

    [upper]
    center_px = [802.3, 598.1]
    rotation_deg = 0.0
    scale = 1.0

    [lower]
    center_px = [800.1, 601.6]
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationError

from designer.design import VIEW_NAMES
from designer.files import InputError, describe_validation_error, read_toml, write_atomically
from designer.imaging.stereo.placement import ImagePlacement, Placement, ViewPlacements, placement_of_view

Coordinate = Annotated[float, Strict(), Field(ge=-1e6, le=1e6, allow_inf_nan=False)]
Degrees = Annotated[float, Strict(), Field(ge=-360.0, le=360.0, allow_inf_nan=False)]
Scale = Annotated[float, Strict(), Field(ge=0.1, le=10.0, allow_inf_nan=False)]


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class _ViewTable(_Table):
    center_px: Annotated[list[Coordinate], Field(min_length=2, max_length=2)]
    rotation_deg: Degrees = 0.0
    scale: Scale = 1.0

    def placement(self) -> ImagePlacement:
        u, v = self.center_px
        return ImagePlacement((u, v), float(np.radians(self.rotation_deg)), self.scale)


class _PlacementTable(_Table):
    upper: _ViewTable
    lower: _ViewTable


def read_placement(path: Path) -> Placement:
    """Read and validate a placement file; a single placement where both views have the same.

    Raises
    ------
    InputError
        The file cannot be read, is not TOML, or holds something that cannot be: one line says what is allowed.
    """
    content = read_toml(path)
    try:
        tables = _PlacementTable.model_validate(content)
    except ValidationError as error:
        raise InputError(describe_validation_error(path, error)) from None
    upper, lower = tables.upper.placement(), tables.lower.placement()
    return upper if upper == lower else ViewPlacements(upper=upper, lower=lower)


def write_placement(path: Path, placement: Placement) -> None:
    """Write a placement file: one table for each view, in full digits."""
    tables = []
    for name in VIEW_NAMES:
        of_view = placement_of_view(placement, name)
        u, v = (float(part) for part in of_view.center_px)
        tables.append(
            f"[{name}]\ncenter_px = [{u!r}, {v!r}]\n"
            f"rotation_deg = {float(np.degrees(of_view.rotation_rad))!r}\nscale = {float(of_view.scale)!r}\n"
        )
    write_atomically(
        path, "# Where the image of each view lies, for designer stereo --placement.\n" + "\n".join(tables)
    )
