"""The target on paper and in images: what is printed is what OpenCV looks for, and corners are where they are drawn."""

from __future__ import annotations

import io
import re

import cv2
import numpy as np
import pytest

from designer import api
from designer.as_built.parameters import parameters_of
from designer.as_built.tolerances import tolerance_values, tolerances_of_grade
from designer.as_built.yields import draw_departures
from designer.calibration.calibrate import calibrate
from designer.calibration.corners import refine_corners
from designer.calibration.detection import detect
from designer.calibration.first_guess import first_pose
from designer.calibration.images import pixels_of
from designer.calibration.target import MODULES, Target, board_of, make_target, modules_of, read_target, write_target
from designer.calibration.target_page import MARGIN_MM, target_pdf
from designer.calibration.target_pose import facing_pose
from designer.design import VIEW_NAMES
from designer.files import InputError
from support.calibration_targets import drawn_image, in_camera_frame
from support.studied_designs import sharp_design

DESIGN = sharp_design("indoor_robot:folded-HyHy-Hy-upper_outer")
TARGET = make_target(9, 6, 40.0)
PARAMETERS = len(parameters_of(DESIGN)) + 2


def drawn_page(pdf: bytes, target: Target) -> np.ndarray:
    """The board's modules as the rectangles of a page, painted in their order, leave them."""
    pypdf = pytest.importorskip("pypdf")
    page = pypdf.PdfReader(io.BytesIO(pdf)).pages[0]
    points_per_mm = 72.0 / 25.4
    module = target.square_mm / MODULES * points_per_mm
    height = float(page.mediabox.height)
    # Ten samples for each module, so that edges that are off would show.
    canvas = np.ones((10 * MODULES * target.rows, 10 * MODULES * target.columns))
    matrix, stack, fill, path = np.eye(3), [], 0.0, []
    for operands, operator in pypdf.generic.ContentStream(page.get_contents(), None).operations:
        numbers = [float(each) for each in operands if isinstance(each, int | float | pypdf.generic.FloatObject)]
        if operator == b"q":
            stack.append((matrix, fill))
        elif operator == b"Q":
            matrix, fill = stack.pop()
        elif operator == b"cm":
            a, b, c, d, e, f = numbers
            matrix = np.array([[a, b, 0.0], [c, d, 0.0], [e, f, 1.0]]) @ matrix
        elif operator in {b"g", b"sc", b"scn", b"rg", b"k"}:
            fill = float(np.mean(numbers))
        elif operator in {b"m", b"l"}:
            path.append((np.array([*numbers, 1.0]) @ matrix)[:2])
        elif operator == b"re":
            x, y, wide, high = numbers
            path += [(np.array([*p, 1.0]) @ matrix)[:2] for p in ((x, y), (x + wide, y + high))]
        elif operator in {b"f", b"f*"} and path:
            x, y = np.array(path).T
            ends = np.array([x.min(), x.max()]), height - np.array([y.max(), y.min()])
            columns, rows = (np.rint(10.0 * (part - MARGIN_MM * points_per_mm) / module).astype(int) for part in ends)
            if min(columns[0], rows[0]) >= 0 and columns[1] <= canvas.shape[1] and rows[1] <= canvas.shape[0]:
                canvas[rows[0] : rows[1], columns[0] : columns[1]] = fill
            path = []
        elif operator in {b"n", b"S"}:
            path = []
    return canvas


def test_the_page_shows_the_board_at_true_scale():
    canvas = drawn_page(target_pdf(TARGET), TARGET)
    assert (canvas == np.kron(modules_of(TARGET), np.ones((10, 10)))).all()


def test_the_modules_are_found_by_opencv():
    picture = np.kron(np.pad(modules_of(TARGET), MODULES, constant_values=1), np.ones((6, 6))).astype(np.uint8) * 255
    board = board_of(TARGET)
    corners, numbers, _, _ = cv2.aruco.CharucoDetector(board.charuco).detectBoard(picture)
    assert sorted(np.asarray(numbers).ravel()) == list(range(8 * 5))
    places = board.corners_mm[np.asarray(numbers).ravel(), :2] * 6 * MODULES / TARGET.square_mm + 6 * MODULES - 0.5
    assert np.abs(np.asarray(corners).reshape(-1, 2) - places).max() < 0.05


def test_a_targets_file_is_read_as_it_was_written(tmp_path):
    write_target(tmp_path / "target.toml", TARGET)
    assert read_target(tmp_path / "target.toml") == TARGET
    for text, reason in (
        ("columns = 2", r"columns = 2: must be greater than or equal to 3"),
        ("square = 2.0", r"square"),
        ("columns = 40\nrows = 40", r"800 markers; at most 250"),
        ("columns = [", r"not valid TOML"),
    ):
        (tmp_path / "other.toml").write_text(text)
        with pytest.raises(InputError, match=reason) as caught:
            read_target(tmp_path / "other.toml")
        assert re.match(r".*other\.toml: ", str(caught.value))
        assert "\n" not in str(caught.value)


def test_corners_are_found_in_both_views_to_a_fiftieth_of_a_pixel():
    """In a drawn image of a sensor that is not as designed, by the design's tables and a pose guessed from them."""
    grade = tolerances_of_grade("standard")
    departures = draw_departures(tolerance_values(DESIGN, parameters_of(DESIGN), grade), 1, 2)[0]
    values = np.append(departures, [4.0, -3.0])
    pose = facing_pose(TARGET.size_mm, 25.0, 360.0, DESIGN.views.middle_mm, (15.0, -20.0, 10.0))
    raw, board = drawn_image(DESIGN, values, TARGET, pose), board_of(TARGET)
    found = detect(DESIGN, raw, board)
    assert set(found) == set(VIEW_NAMES)
    guess, missed_px = first_pose(DESIGN, board, found, np.zeros(PARAMETERS))
    assert missed_px < 20.0
    assert np.linalg.norm(guess.place_mm - pose.place_mm) < 20.0
    for view, detected in found.items():
        better = refine_corners(DESIGN, view, raw, TARGET, board, detected, guess, np.zeros(PARAMETERS))
        assert len(better.numbers) > 0.8 * len(detected.numbers)
        true = pixels_of(DESIGN, view, pose.points(board.corners_mm[better.numbers]), values)
        off = better.pixels - true
        assert np.sqrt(np.mean(off**2)) < 0.02
        rough = detected.pixels - pixels_of(DESIGN, view, pose.points(board.corners_mm[detected.numbers]), values)
        assert np.sqrt(np.mean(off**2)) < 0.5 * np.sqrt(np.mean(rough**2))


@pytest.mark.slow
def test_a_sensor_is_found_from_drawn_images():
    grade = tolerances_of_grade("coarse")
    departures = draw_departures(tolerance_values(DESIGN, parameters_of(DESIGN), grade), 1, 6)[0]
    values = np.append(departures, [4.0, -3.0])
    random = np.random.default_rng(1)
    raws = [
        drawn_image(
            DESIGN,
            values,
            TARGET,
            facing_pose(
                TARGET.size_mm,
                60.0 * place,
                random.uniform(320.0, 400.0),
                DESIGN.views.middle_mm + random.uniform(-20.0, 20.0),
                tuple(random.uniform(-25.0, 25.0, 3)),
            ),
            seed=place,
        )
        for place in range(6)
    ]
    # One without a target does no harm.
    raws.insert(2, np.full_like(raws[0], 90))
    lines: list[str] = []
    found = calibrate(DESIGN, raws, TARGET, grade, progress=lines.append)
    assert found.images == (0, 1, 3, 4, 5, 6)
    assert lines[2] == "image 3: no target found"
    true, _, _ = in_camera_frame(DESIGN, values)
    free = np.flatnonzero(found.unknowns.free)
    off = np.abs(found.adjusted.values - true)[free] / found.sigma[free]
    assert np.mean(off < 1.96) >= 0.9
    assert off.max() < 4.0


def test_images_that_cannot_be_used_are_refused_in_one_line():
    grade, blank = tolerances_of_grade("coarse"), np.full((1200, 1600), 90, np.uint8)
    with pytest.raises(InputError, match="has shape"):
        api.calibrate(DESIGN, [blank[:100]], TARGET)
    with pytest.raises(InputError, match=r"no target found in 1 image \(image 1\)"):
        api.calibrate(DESIGN, [blank], api.target(9, 6, 40.0))
    pose = facing_pose(TARGET.size_mm, 25.0, 360.0, DESIGN.views.middle_mm)
    raw = drawn_image(DESIGN, np.zeros(PARAMETERS), TARGET, pose)
    with pytest.raises(InputError, match="the target is found in 1 of 1 image: at least 3 different poses"):
        calibrate(DESIGN, [raw], TARGET, grade)
