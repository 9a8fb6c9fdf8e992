"""The prescription with tolerances: rounded numbers stay far within what they allow."""

from __future__ import annotations

import re

import pytest

from designer.as_built.allowances import mirror_allowance
from designer.as_built.tolerances import GRADES, Grade, tolerances_of_grade
from designer.report.content.tables import prescription
from support.studied_designs import SHARP_NAMES, sharp_design

NUMBER = r"([−\d.e-]+)"


def value_of(words: str) -> float:
    return float(words.replace("−", "-"))


@pytest.mark.parametrize("grade", GRADES)
@pytest.mark.parametrize("name", SHARP_NAMES[:6])
def test_numbers_stop_where_their_tolerance_makes_further_digits_idle(name: str, grade: Grade) -> None:
    design, tolerances = sharp_design(name), tolerances_of_grade(grade)
    table = prescription(design, tolerances)
    found = [tuple(map(value_of, pair)) for pair in re.findall(rf"{NUMBER} ±{NUMBER}", table)]
    wanted = []
    for mirror in design.mirrors:
        allowed = mirror_allowance(design, mirror.name, tolerances)
        wanted.append((mirror.vertex_mm, allowed.axial_shift_mm))
        if mirror.radius_mm is not None:
            wanted += [(mirror.radius_mm, allowed.radius_mm), (mirror.conic, allowed.conic)]
    assert len(found) == len(wanted)
    for (printed, printed_tolerance), (true, tolerance) in zip(found, wanted, strict=True):
        assert abs(printed - true) <= 0.051 * tolerance
        assert printed_tolerance == pytest.approx(tolerance, rel=0.05)
    assert "±" not in prescription(design)
