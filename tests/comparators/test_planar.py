"""Plane mirrors: where the camera seems to stand, and what one side of the scene is seen with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from designer.comparators.asked import Asked
from designer.comparators.errors import relative_errors
from designer.comparators.planar import put_together
from support.shipped_problems import requirement_as_shipped

REQUIREMENT = requirement_as_shipped("ceiling_watch")
ASKED = Asked.of(REQUIREMENT, REQUIREMENT.camera.lenses[0])
VALUES = np.array([-0.45, 0.4, 40.0, 90.0, 10.0, -0.3, 0.2, 3.0, 0.0, 8.0])


def test_two_mirrors_turn_the_camera_about_the_line_in_which_they_meet():
    """Both virtual cameras stand as far from that line as the real one, by twice the mirrors' angle apart.

    So the distance between them is 2 d sin(alpha): J. Gluckman and S. K. Nayar, "Planar catadioptric stereo:
    geometry and calibration", CVPR 1999.
    """
    built = put_together(ASKED, VALUES)
    lower, upper = (view.flat for view in built.views)
    across = (upper.height - lower.height) / (np.tan(lower.incline) - np.tan(upper.incline))
    meeting = np.array([across, lower.height + across * np.tan(lower.incline)])
    places = []
    for view, beam in zip(built.views, built.beams, strict=True):
        # The point that the traced rays behind the mirror all come from, by least squares.
        projectors = np.eye(3) - beam.leaving[:, :, None] * beam.leaving[:, None, :]
        place = np.linalg.solve(projectors.sum(axis=0), np.einsum("nij,nj->i", projectors, beam.hits))
        assert np.hypot(place[0] - meeting[0], place[2] - meeting[1]) == pytest.approx(np.hypot(*meeting), rel=1e-9)
        assert view.viewpoint == pytest.approx(view.in_rig(place)[[0, 2]], rel=1e-9)
        places.append(place)
    apart = 2.0 * np.hypot(*meeting) * np.sin(abs(upper.incline - lower.incline))
    assert np.linalg.norm(places[0] - places[1]) == pytest.approx(apart, rel=1e-9)
    assert built.single_viewpoint_error_mm < 1e-9


def test_a_traced_pair_of_rays_meets_in_the_point_and_errs_as_two_pinholes_do():
    """Against depth by brute force: both image places moved by a little, both rays laid together again."""
    built = put_together(ASKED, VALUES)
    distance, azimuth, slope, step = 2000.0, 0.15, -0.5, 1e-3
    height = built.rig.middle_mm + slope * distance
    moved = []
    for view in built.views:
        place = view.places(view.points(np.array([distance]), np.array([height]), azimuth))
        _, start, ahead = view.traced(place + np.array([[0.0, 0.0], [step, 0.0]]))
        horizontal = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        start, end = view.in_rig(start), view.in_rig(start + ahead)
        rise = (end - start)[:, 2] / ((end - start) @ horizontal)
        moved.append((start[:, 2] - start @ horizontal * rise, rise))
    (lower, m_lower), (upper, m_upper) = moved
    meets = (upper[0] - lower[0]) / (m_lower[0] - m_upper[0])
    assert meets == pytest.approx(distance, rel=1e-9)
    by_lower = (upper[0] - lower[1]) / (m_lower[1] - m_upper[0]) - distance
    by_upper = (upper[1] - lower[0]) / (m_lower[0] - m_upper[1]) - distance
    constant = replace(ASKED.conditions, constant=step, predicted_share=0.0)
    error = relative_errors(built.rig, np.array([slope]), np.array([distance]), constant, 0.0, azimuth)[0]
    assert error == pytest.approx(np.hypot(by_lower, by_upper) / distance, rel=0.02)
