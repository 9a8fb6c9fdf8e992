"""Tolerances on drawing sheets: the numbers with which sensors are built, and what they do to the sag in 40 digits."""

from __future__ import annotations

import re
from itertools import product
from pathlib import Path

import mpmath
import numpy as np
import pytest
from click.testing import CliRunner

from designer.as_built.allowances import camera_allowance, mirror_allowance
from designer.as_built.named import NamedTolerances, named_tolerances
from designer.as_built.parameters import CAMERA, parameters_of
from designer.as_built.tolerances import tolerance_values, tolerances_of_grade
from designer.cli import cli
from designer.design import Design, write_design
from designer.evaluate.face_dimensions import face_dimensions
from designer.export.drawing.sheets import sheet_sources
from designer.export.formats import EXPORTS, export_design, exported_files
from designer.export.order.words import read_me
from designer.extras import is_installed
from designer.files import InputError
from support.sheets import printed_words
from support.studied_designs import SHARP_NAMES, sharp_design

OWN = """
grade = "coarse"
[mirrors]
tilt_deg = 0.03
[mirror.NAME]
radius_percent = 0.07
decentre_mm = 0.025
"""


def own_tolerances(folder: Path, design: Design) -> NamedTolerances:
    path = folder / "own.toml"
    named = next(mirror.name for mirror in design.mirrors if mirror.radius_mm is not None)
    path.write_text(OWN.replace("NAME", named), encoding="utf-8")
    return named_tolerances(str(path), design)


@pytest.mark.parametrize("name", SHARP_NAMES)
def test_parts_are_allowed_what_sensors_are_built_with(name: str, tmp_path: Path) -> None:
    design = sharp_design(name)
    tolerances = own_tolerances(tmp_path, design).values
    parameters = parameters_of(design)
    values = tolerance_values(design, parameters, tolerances)
    built = {(each.part, each.key): value for each, value in zip(parameters, values, strict=True)}
    for mirror in design.mirrors:
        allowed = mirror_allowance(design, mirror.name, tolerances)
        of_shape = (
            {"curvature_per_m": allowed.curvature_per_m}
            if mirror.radius_mm is None
            else {"radius_departure_mm": allowed.radius_mm, "conic_departure": allowed.conic}
        )
        said = of_shape | {
            "decentre_x_mm": allowed.decentre_mm,
            "decentre_y_mm": allowed.decentre_mm,
            "tilt_x_deg": allowed.tilt_deg,
            "tilt_y_deg": allowed.tilt_deg,
            "axial_shift_mm": allowed.axial_shift_mm,
        }
        assert said == pytest.approx({key: built[part, key] for part, key in built if part == mirror.name}, rel=1e-12)
    camera = camera_allowance(design, tolerances)
    assert camera.principal_distance_mm == pytest.approx(built[CAMERA, "principal_distance_departure_mm"], rel=1e-12)
    assert (camera.shift_mm, camera.tilt_deg) == (built[CAMERA, "shift_x_mm"], built[CAMERA, "tilt_y_deg"])


def exact_sag(radius: mpmath.mpf, conic: mpmath.mpf, r: mpmath.mpf) -> mpmath.mpf:
    return r**2 / (radius * (1 + mpmath.sqrt(1 - (1 + conic) * r**2 / radius**2)))


@pytest.mark.parametrize("name", SHARP_NAMES[:4])
def test_the_sag_moves_by_as_much_as_the_sheet_says(name: str) -> None:
    design, tolerances = sharp_design(name), tolerances_of_grade("standard")
    for mirror in design.mirrors:
        allowed = mirror_allowance(design, mirror.name, tolerances)
        inner, outer = face_dimensions(design, mirror.name).clear_radii_mm
        with mpmath.workdps(40):
            if mirror.radius_mm is None:
                curvature = mpmath.mpf(allowed.curvature_per_m) / 1000
                largest = outer**2 * curvature / (1 + mpmath.sqrt(1 - (curvature * outer) ** 2))
            else:
                radius, conic = mpmath.mpf(mirror.radius_mm), mpmath.mpf(mirror.conic)
                corners = product((-1, 1), (-1, 1), np.linspace(inner, outer, 41))
                largest = max(
                    abs(
                        exact_sag(radius + one * allowed.radius_mm, conic + other * allowed.conic, mpmath.mpf(r))
                        - exact_sag(radius, conic, mpmath.mpf(r))
                    )
                    for one, other, r in corners
                )
        assert allowed.sag_mm == pytest.approx(float(largest), rel=1e-6)


def test_the_sheets_carry_them(tmp_path: Path) -> None:
    design = sharp_design(SHARP_NAMES[0])
    tolerances = own_tolerances(tmp_path, design)
    words = {sheet: " ".join(printed_words(s).split()) for sheet, s in sheet_sources(design, tolerances).items()}
    for mirror in design.mirrors:
        assert "Tolerances, of own.toml" in words[mirror.name]
        allowed = mirror_allowance(design, mirror.name, tolerances.values)
        if mirror.radius_mm is not None:
            radius, conic = re.search(r"R within ±(\S+) mm, K within ±(\S+?):", words[mirror.name]).groups()
            assert float(radius) == pytest.approx(allowed.radius_mm, rel=5e-3)
            assert float(conic) == allowed.conic
    assert "±0.025 mm in x and in y" in words["assembly"]
    assert "tilted by at most 0.03° about x and about y" in words["assembly"]
    assert "run designer tolerance" not in words["assembly"]


@pytest.mark.parametrize("name", [name for name, entry in EXPORTS.items() if entry.toleranced is None])
def test_other_formats_have_no_place_for_them(name: str, tmp_path: Path) -> None:
    if EXPORTS[name].extra is not None and not is_installed(EXPORTS[name].extra):
        pytest.skip(f"the extra {EXPORTS[name].extra} is not installed")
    asked = NamedTolerances("coarse", tolerances_of_grade("coarse"))
    with pytest.raises(InputError, match=rf"tolerances coarse: {name} has no place for them; these have: drawing"):
        exported_files(sharp_design(SHARP_NAMES[0]), name, asked)
    assert not list(tmp_path.iterdir())


def test_a_command_names_what_is_wrong(tmp_path: Path) -> None:
    path = tmp_path / "design.json"
    write_design(sharp_design(SHARP_NAMES[0]), path)
    for named, said in (("fine", "tolerances fine: must be coarse, standard, precision"), ("no.toml", "no.toml: ")):
        found = CliRunner().invoke(
            cli, ["export", str(path), "--to", "sag", "--tolerances", named, "-o", str(tmp_path / "out")]
        )
        assert found.exit_code != 0
        assert isinstance(found.exception, InputError | SystemExit)
        assert said in f"{found.output}{found.exception}"


@pytest.mark.skipif(not is_installed("drawing"), reason="typst, which typesets drawing sheets, is not installed")
def test_the_printed_sheets_differ_with_tolerances(tmp_path: Path) -> None:
    design = sharp_design(SHARP_NAMES[0])
    asked = NamedTolerances("precision", tolerances_of_grade("precision"))
    written = export_design(design, "drawing", tmp_path / "sheets", asked)
    plain = export_design(design, "drawing", tmp_path / "plain")
    assert [path.name for path in written] == [path.name for path in plain]
    assert all(one.read_bytes() != other.read_bytes() for one, other in zip(written, plain, strict=True))


def test_the_readme_of_an_order_says_what_is_still_open() -> None:
    design = sharp_design(SHARP_NAMES[0])
    asked = NamedTolerances("precision", tolerances_of_grade("precision"))
    with_them, without = read_me(design, ["drawing"], {}, [], asked), read_me(design, ["drawing"], {}, [])
    assert "tolerances.toml`: the tolerances that the drawings carry, those of the precision grade" in with_them
    assert "Tolerances of each mirror's place and tilt" not in with_them
    assert "Tolerances of each mirror's place and tilt" in without
    assert all("What holds the mirrors" in each for each in (with_them, without))
