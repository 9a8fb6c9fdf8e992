"""Sheets as DXF, read back by ezdxf: dimensions measure what they say, outlines are conics, no word is missing."""

from __future__ import annotations

import io
import re

import mpmath
import numpy as np
import pytest

from designer.as_built.named import named_tolerances
from designer.design import Design
from designer.evaluate.face_dimensions import into_substrate
from designer.export.assembly_name import ASSEMBLY
from support.sheets import NUMBER, number_of, rebuilt
from support.studied_designs import NAMES, SHARP_NAMES, sharp_design, studied_design

ezdxf = pytest.importorskip("ezdxf", reason="ezdxf, which writes and reads DXF, is not installed")

from designer.export.drawing.dxf_sheets import HEIGHT_MM, WIDTH_MM, dxf_sheets  # noqa: E402
from designer.export.drawing.sheet import sheets_of  # noqa: E402


def spaces_of(design: Design, **options: object):
    found = {}
    for sheet, text in dxf_sheets(design, **options).items():
        document = ezdxf.read(io.StringIO(text))
        assert not document.audit().errors
        assert document.units == ezdxf.units.MM
        found[sheet] = document.modelspace()
    return found


@pytest.mark.parametrize("name", SHARP_NAMES)
def test_every_dimension_measures_what_it_says(name: str) -> None:
    for space in spaces_of(sharp_design(name)).values():
        dimensions = space.query("DIMENSION")
        assert len(dimensions) >= 2
        for dimension in dimensions:
            said = number_of(re.search(NUMBER, dimension.dxf.text.replace("Ø", "")).group(1))
            assert dimension.get_measurement() == pytest.approx(said, abs=0.5001e-3)


@pytest.mark.parametrize("name", NAMES)
def test_outlines_are_the_conic_in_true_millimetres(name: str) -> None:
    """Rises from the first point of the face, in forty digits; the back is the face moved by the thickness."""
    design = studied_design(name)
    for sheet, space in spaces_of(design).items():
        if sheet == ASSEMBLY:
            continue
        mirror = design.mirror(sheet)
        outline = max(space.query('LWPOLYLINE[layer=="outlines"]'), key=len)
        points = np.array([point[:2] for point in outline.get_points()])
        front, back = points[: len(points) // 2], points[len(points) // 2 :][::-1]
        assert back - front == pytest.approx(np.tile([mirror.thickness_mm, 0.0], (len(front), 1)), abs=1e-9)
        offsets = front[:, 1] - front[:, 1].mean() if mirror.inner_radius_mm == 0.0 else front[:, 1] - front[0, 1]
        radii = offsets if mirror.inner_radius_mm == 0.0 else mirror.inner_radius_mm + np.abs(offsets)
        assert abs(radii).max() == pytest.approx(mirror.outer_radius_mm, abs=1e-9)
        with mpmath.workdps(40):
            sags = [exact_depth(mirror, radius) for radius in radii]
        rises = np.array([float(sag - sags[0]) for sag in sags])
        assert front[:, 0] - front[0, 0] == pytest.approx(rises, abs=1e-8)


def exact_depth(mirror, radius: float) -> mpmath.mpf:
    if mirror.radius_mm is None:
        return mpmath.mpf(0)
    r, vertex, conic = mpmath.mpf(float(radius)), mpmath.mpf(mirror.radius_mm), mpmath.mpf(mirror.conic)
    return into_substrate(mirror) * r**2 / (vertex * (1 + mpmath.sqrt(1 - (1 + conic) * r**2 / vertex**2)))


@pytest.mark.parametrize("name", NAMES)
def test_the_words_rebuild_the_prescription_to_the_last_digit(name: str) -> None:
    design = studied_design(name)
    words = {
        sheet: " ".join(text.dxf.text for text in space.query("TEXT")) for sheet, space in spaces_of(design).items()
    }
    for mirror in design.mirrors:
        found = rebuilt(words[mirror.name], words[ASSEMBLY], mirror.name)
        assert found == {key: getattr(mirror, key) for key in found}


@pytest.mark.parametrize("name", SHARP_NAMES[:3])
def test_nothing_of_a_sheet_is_left_out_or_leaves_the_frame(name: str) -> None:
    design = sharp_design(name)
    tolerances = named_tolerances("precision")
    sheets = sheets_of(design, tolerances)
    for sheet, space in spaces_of(design, tolerances=tolerances).items():
        size = 1.0 / sheets[sheet].drawn.scale
        said = " ".join(text.dxf.text for text in space.query("TEXT"))
        for heading, rows in sheets[sheet].groups:
            assert heading in said
            for field, words in rows:
                assert f"{field} {' '.join(words.split())}".strip() in said
        assert "precision grade" in said
        for text in space.query("TEXT"):
            x, y, _ = text.get_placement()[1]
            assert 0.0 <= x <= WIDTH_MM * size
            assert 0.0 <= y <= HEIGHT_MM * size


def test_the_same_design_gives_the_same_bytes() -> None:
    assert dxf_sheets(sharp_design(SHARP_NAMES[0])) == dxf_sheets(sharp_design(SHARP_NAMES[0]))
