"""Sag tables against the implicit equation of the conic, solved in forty digits."""

import csv
import math
from functools import partial

import mpmath
import pytest

from designer.design import Mirror
from designer.export.sag import sag_tables
from designer.files import InputError
from support.studied_designs import NAMES, studied_design

NANOMETRE = 1e-6


def read_table(text: str) -> tuple[list[str], list[dict[str, float]]]:
    """Comment lines and rows of a table."""
    lines = text.splitlines()
    comments = [line.removeprefix("# ") for line in lines if line.startswith("#")]
    rows = csv.DictReader(line for line in lines if not line.startswith("#"))
    return comments, [{name: float(value) for name, value in row.items()} for row in rows]


def height_on_conic(mirror: Mirror, radius: float) -> mpmath.mpf:
    """The root of c (r^2 + (1 + K) z^2) = 2 z on the vertex sheet, where 1 - (1 + K) c z is not negative."""
    if mirror.radius_mm is None:
        return mpmath.mpf(0)
    c, k, r = 1 / mpmath.mpf(mirror.radius_mm), 1 + mpmath.mpf(mirror.conic), mpmath.mpf(radius)
    if k == 0:
        return c * r**2 / 2
    roots = mpmath.polyroots([c * k, -2, c * r**2], maxsteps=200, extraprec=200)
    return next(mpmath.re(root) for root in roots if mpmath.re(1 - k * c * root) >= 0)


@pytest.mark.parametrize("name", NAMES)
def test_every_row_lies_on_the_conic_within_half_a_nanometre(name: str) -> None:
    design = studied_design(name)
    tables = sag_tables(design)
    assert list(tables) == [mirror.name for mirror in design.mirrors]
    for mirror in design.mirrors:
        _, rows = read_table(tables[mirror.name])
        assert (rows[0]["radius_mm"], rows[-1]["radius_mm"]) == (mirror.inner_radius_mm, mirror.outer_radius_mm)
        assert 200 <= len(rows) <= 1002
        with mpmath.workdps(40):
            for row in rows[:: len(rows) // 10] + rows[-1:]:
                radius = mpmath.mpf(row["radius_mm"])
                assert abs(height_on_conic(mirror, row["radius_mm"]) - row["sag_mm"]) < 0.5 * NANOMETRE
                rise = mpmath.diff(partial(height_on_conic, mirror), radius, h=mpmath.mpf("1e-12"))
                assert row["slope_deg"] == pytest.approx(float(mpmath.degrees(mpmath.atan(rise))), abs=1e-8)


@pytest.mark.parametrize("name", NAMES)
def test_the_header_alone_makes_the_mirror(name: str) -> None:
    """Conic constant, radius and vertex are there in full, and the best-fit sphere gives the distances."""
    design = studied_design(name)
    for mirror, text in zip(design.mirrors, sag_tables(design).values(), strict=True):
        comments, rows = read_table(text)
        said = dict(line.split(": ", 1) for line in comments if ": " in line)
        assert float(said["conic constant K"]) == mirror.conic
        assert float(said["vertex height"].split()[0]) == mirror.vertex_mm
        if mirror.radius_mm is None:
            assert "infinite" in said["vertex radius R"]
            assert all(row["sag_mm"] == row["slope_deg"] == 0.0 for row in rows)
            assert "from_best_fit_sphere_mm" not in rows[0]
            continue
        assert float(said["vertex radius R"].split()[0]) == mirror.radius_mm
        words = said["best-fit sphere"].split()
        radius, centre = float(words[1]), float(words[4])
        for row in rows[::50]:
            away = math.hypot(row["radius_mm"], row["sag_mm"] - centre) - radius
            assert row["from_best_fit_sphere_mm"] == pytest.approx(away, abs=2e-9)
        # A least-squares sphere of one zone has the face on both sides of it.
        distances = [row["from_best_fit_sphere_mm"] for row in rows]
        assert min(distances) < 0.0 < max(distances)


def test_a_face_that_ends_at_its_equator_keeps_the_nanometre() -> None:
    design = studied_design(NAMES[0])
    rim = 20.0
    mirror = design.mirrors[0].model_copy(
        update={"kind": "ellipsoid", "conic": 0.0, "radius_mm": -rim / (1.0 - 1e-13), "outer_radius_mm": rim}
    )
    (text,) = sag_tables(design.model_copy(update={"mirrors": (mirror,)})).values()
    _, rows = read_table(text)
    with mpmath.workdps(40):
        for row in rows[-30:]:
            assert abs(height_on_conic(mirror, row["radius_mm"]) - row["sag_mm"]) < 0.5 * NANOMETRE


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"outer_radius_mm": 1e9}, "cannot be tabled"),
        ({"radius_mm": 1e-6, "conic": -1.0, "kind": "paraboloid"}, "steeper than a table"),
    ],
)
def test_what_no_table_holds_is_refused(changes: dict[str, object], words: str) -> None:
    design = studied_design(NAMES[0])
    mirror = design.mirrors[0].model_copy(update=changes)
    with pytest.raises(InputError, match=words):
        sag_tables(design.model_copy(update={"mirrors": (mirror,)}))
