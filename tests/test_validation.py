"""The validation page says what the code gives now and what others found, and nothing here can rewrite the latter."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from validation.page import difference, page
from validation.row import THEIRS, all_of_theirs
from validation.rows import ROWS

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
OURS = dict(
    zip(
        (row.key for row in ROWS),
        re.findall(r"^\| \d+ \|.*\| (\S+) \| [^|]+ \|$", TEXT, re.MULTILINE),
        strict=True,
    )
)
# Half a unit of the last published digit, a step of POV-Ray's tones, the quadrature rule, two solvers' tolerances.
ALLOWED = {
    "jaramillo_fold_radius_mm": 5e-4,
    "jaramillo_hole_radius_mm": 5e-4,
    "povray_height_mm": 800.0 / 65535.0,
    "score_integral": 1e-5 * 0.01237,
    "trimesh_volume_mm3": 1e-3,
    "evolution_percent": 1e-6 * 1.4785,
}
SMALLEST = 2e-9


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.key)
def test_the_page_agrees_with_others(row):
    found = difference(row, OURS[row.key])
    if row.is_bound:
        assert found == "kept"
    else:
        assert abs(float(found)) <= ALLOWED.get(row.key, SMALLEST)


@pytest.mark.parametrize("row", [row for row in ROWS if row.is_quick], ids=lambda row: row.key)
def test_the_code_gives_the_pages_digits(row):
    # The last digit printed may round either way on another processor.
    step = 10.0 ** -int(re.search(r"\.(\d+)f", row.format)[1])
    assert row.ours() == pytest.approx(float(OURS[row.key]), abs=1.01 * step)


@pytest.mark.slow
@pytest.mark.parametrize("row", [row for row in ROWS if not row.is_quick], ids=lambda row: row.key)
def test_the_optimiser_gives_the_pages_digits(row):
    assert row.ours() == pytest.approx(float(OURS[row.key]), rel=2e-6)


def test_the_page_is_the_generators():
    assert page(ROWS, OURS) == TEXT


def test_every_number_of_others_is_used_and_has_a_source():
    assert set(all_of_theirs()) == {row.key for row in ROWS}
    assert len(ROWS) >= 12
    for row in ROWS:
        digits = len(row.theirs.digits.replace(".", "").replace("-", "").lstrip("0"))
        assert digits >= 6 or row.few_digits, row.key
        assert row.theirs.source
        if row.theirs.how.startswith("python -m "):
            module = row.theirs.how.split()[-1].replace(".", "/")
            assert (ROOT / f"{module}.py").exists()


def test_no_code_writes_the_numbers_of_others():
    """Only reading code mentions their folder."""
    mentions = [
        file
        for place in ("validation", "tests", "benchmarks", "designer")
        for file in (ROOT / place).rglob("*.py")
        if "THEIRS" in file.read_text(encoding="utf-8")
    ]
    assert {file.name for file in mentions} == {"row.py", "test_validation.py"}
    assert "write" not in (ROOT / "validation" / "row.py").read_text(encoding="utf-8")
    assert THEIRS.is_dir()
