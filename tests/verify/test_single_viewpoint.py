"""The tracer's measure of a single viewpoint: nothing at any azimuth of a design, and what a moved viewpoint adds."""

from __future__ import annotations

import numpy as np
import pytest

from designer.design import VIEW_NAMES, Design, ViewName
from designer.trace.instrument import build_instrument
from designer.verify.coverage import single_viewpoint_residuals
from support.studied_designs import NAMES, studied_design

# All four quadrants, and none of them a multiple of 45 degrees, where a mistaken component may cancel.
AZIMUTHS = np.radians([7.0, 61.0, 113.0, 158.0, 207.0, 244.0, 293.0, 341.0])


def rays(design: Design, view: ViewName) -> tuple[np.ndarray, np.ndarray]:
    """Image angles within the view's zone, by the gain law, each at every azimuth."""
    record = design.views.by_name[view]
    sign = 1.0 if record.sense == "direct" else -1.0
    elevations = np.radians(np.linspace(*record.elevation_deg, 5)[1:-1])
    psi = 2.0 * np.arctan(np.abs(record.gain * np.tan(np.pi / 4.0 + sign * elevations / 2.0)))
    return np.repeat(psi, AZIMUTHS.size), np.tile(AZIMUTHS, psi.size)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("view", VIEW_NAMES)
def test_every_azimuth_keeps_the_viewpoint_and_the_gain(name: str, view: ViewName) -> None:
    design, instrument = studied_design(name), build_instrument(studied_design(name))
    record, (psi, azimuth) = design.views.by_name[view], rays(studied_design(name), view)
    path = instrument.path(record.path)
    found = [
        single_viewpoint_residuals(instrument, path, record.viewpoint_mm, record.gain, record.sense, *ray)
        for ray in zip(psi[:, None], azimuth[:, None], strict=True)
    ]
    miss, off_law = np.array(found).T
    assert np.all(miss < 1e-8)
    assert np.all(off_law < 1e-10)


@pytest.mark.parametrize("name", NAMES[:4])
def test_a_viewpoint_that_is_not_there_is_missed_by_its_shift(name: str) -> None:
    """Rays at the elevation e pass a point that is moved along the axis at the distance shift cos(e)."""
    design, instrument = studied_design(name), build_instrument(studied_design(name))
    record, (psi, azimuth) = design.views.upper, rays(studied_design(name), "upper")
    moved = record.viewpoint_mm + 0.1
    miss, _ = single_viewpoint_residuals(
        instrument, instrument.path(record.path), moved, record.gain, record.sense, psi, azimuth
    )
    elevations = np.radians(np.linspace(*record.elevation_deg, 5)[1:-1])
    assert miss == pytest.approx(0.1 * np.cos(elevations).max(), rel=1e-6)
