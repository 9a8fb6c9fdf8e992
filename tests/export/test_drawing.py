"""Drawing sheets: the prescription rebuilt from their words alone, the digits that matter, dimensions once."""

import io
import math
import re

import mpmath
import numpy as np
import pytest

from designer.design import Design, Mirror, read_design
from designer.evaluate.face_dimensions import decimals_that_matter, face_dimensions
from designer.export.drawing.paper import TEXT_PT, hatched, text_width_mm
from designer.export.drawing.sheets import drawing_sheets, sheet_sources
from designer.extras import is_installed
from designer.files import InputError
from support import DATA
from support.sheets import NUMBER, number_of, printed_words, rebuilt
from support.studied_designs import NAMES, SHARP_NAMES, sharp_design, studied_design
from support.wide_designs import LAWS, wide_design

NEEDS_TYPST = pytest.mark.skipif(not is_installed("drawing"), reason="typst, which typesets sheets, is not installed")
NANOMETRE = 1e-6
PROTOTYPE = read_design(DATA / "folded_hypl_hy.json")


def assert_rebuilt(design: Design, words: dict[str, str]) -> None:
    for mirror in design.mirrors:
        found = rebuilt(words[mirror.name], words["assembly"], mirror.name)
        assert found == {key: getattr(mirror, key) for key in found}


@pytest.mark.parametrize("name", NAMES)
def test_the_words_of_the_sheets_rebuild_the_prescription_to_the_last_digit(name: str) -> None:
    design = studied_design(name)
    assert_rebuilt(design, {sheet: printed_words(source) for sheet, source in sheet_sources(design).items()})


@NEEDS_TYPST
@pytest.mark.parametrize("name", [SHARP_NAMES[1], NAMES[0]])
def test_the_printed_pages_rebuild_the_prescription_to_the_last_digit(name: str) -> None:
    pypdf = pytest.importorskip("pypdf", reason="pypdf, which reads text from PDF, is not installed")
    design = sharp_design(name) if name in SHARP_NAMES else studied_design(name)
    words = {}
    for sheet, pdf in drawing_sheets(design).items():
        (page,) = pypdf.PdfReader(io.BytesIO(pdf)).pages
        words[sheet] = " ".join(page.extract_text().split())
    assert_rebuilt(design, words)


@pytest.mark.parametrize("law", LAWS)
def test_the_assembly_names_the_law_of_a_lens_to_the_last_digit(law: str) -> None:
    design = wide_design(law)
    words = printed_words(sheet_sources(design)["assembly"])
    assert f"projection {design.camera.projection}, r = " in re.sub(r"\s+", " ", words)
    coefficients = [number_of(found) for found in re.findall(rf"k\d = {NUMBER}", words)]
    assert coefficients == list(design.camera.distortion)
    perspective = printed_words(sheet_sources(studied_design(NAMES[0]))["assembly"])
    assert "projection" not in perspective


def test_the_sheets_point_to_the_budget_of_tolerances() -> None:
    for source in sheet_sources(studied_design(NAMES[0])).values():
        assert "run designer tolerance for what each departure costs" in printed_words(source)


@NEEDS_TYPST
def test_the_same_design_gives_the_same_bytes() -> None:
    assert drawing_sheets(studied_design(NAMES[0])) == drawing_sheets(studied_design(NAMES[0]))


def exact_sag(radius: mpmath.mpf, conic: mpmath.mpf, rim: float) -> mpmath.mpf:
    r = mpmath.mpf(rim)
    return r**2 / (radius * (1 + mpmath.sqrt(1 - (1 + conic) * r**2 / radius**2)))


def moved_sag(mirror: Mirror, by_radius: float, by_conic: float) -> float:
    """How far the sag of the rim moves at most if radius and conic constant are off by so much, either way."""
    with mpmath.workdps(40):
        radius, conic, rim = mpmath.mpf(mirror.radius_mm), mpmath.mpf(mirror.conic), mirror.outer_radius_mm
        true = exact_sag(radius, conic, rim)
        moved = [exact_sag(radius + a * by_radius, conic + b * by_conic, rim) for a in (-1, 1) for b in (-1, 1)]
        return float(max(abs(sag - true) for sag in moved))


@pytest.mark.parametrize("name", NAMES)
def test_the_digits_that_matter_keep_the_nanometre_and_one_less_would_not(name: str) -> None:
    """Radius and conic constant off by half a unit of their last digit, in forty digits."""
    for mirror in studied_design(name).mirrors:
        if mirror.radius_mm is None:
            continue
        by_radius, by_conic = decimals_that_matter(mirror)
        assert moved_sag(mirror, 0.5 * 10.0**-by_radius, 0.5 * 10.0**-by_conic) <= 1.001 * NANOMETRE
        assert by_radius == 0 or moved_sag(mirror, 5.0 * 10.0**-by_radius, 0.0) > 0.5 * NANOMETRE
        assert by_conic == 0 or moved_sag(mirror, 0.0, 5.0 * 10.0**-by_conic) > 0.5 * NANOMETRE


@pytest.mark.parametrize("name", SHARP_NAMES)
def test_every_dimension_stands_once_and_agrees_with_the_part(name: str) -> None:
    """Diameters of edge, hole and clear aperture, thickness; the sags to check lie on the conic."""
    design = sharp_design(name)
    sources = sheet_sources(design)
    for mirror in design.mirrors:
        source = sources[mirror.name]
        labels = re.findall(r'#label-at\([^"]*"([^"]*)"', source)
        clear = face_dimensions(design, mirror.name).clear_radii_mm
        assert clear == (mirror.inner_radius_mm + 0.5, mirror.outer_radius_mm - 0.5)
        expected = [
            f"⌀{2 * mirror.outer_radius_mm:.3f}",
            f"⌀{2 * mirror.inner_radius_mm:.3f}",
            f"clear ⌀{2 * clear[1]:.3f}",
            f"clear ⌀{2 * clear[0]:.3f}",
            f"{mirror.thickness_mm:.3f}",
        ]
        assert [labels.count(text) for text in expected] == [1] * 5
        words = printed_words(source)
        if mirror.radius_mm is None:
            continue
        checks = re.findall(rf"([\d.]+) → {NUMBER}", words)
        assert len(checks) == 3
        upwards = 1.0 if mirror.faces == "down" else -1.0
        with mpmath.workdps(40):
            for radius, depth in checks:
                true = exact_sag(mpmath.mpf(mirror.radius_mm), mpmath.mpf(mirror.conic), float(radius))
                assert abs(upwards * true - number_of(depth)) < 0.51 * NANOMETRE


def label_boxes(source: str) -> list[tuple[str, np.ndarray]]:
    """Text of each label with the corners (2, 2) of its box on paper, mm."""
    boxes = []
    pattern = r'#label-at\(([-\d.]+)mm, ([-\d.]+)mm, "([^"]*)", (\w+)(, upright: true)?, size: ([\d.]+)pt\)'
    for x, y, text, anchor, upright, size in re.findall(pattern, source):
        wide, high = text_width_mm(text) * float(size) / TEXT_PT, 0.7 * 0.3528 * float(size)
        shift = {"center": 0.0, "left": wide / 2.0, "right": -wide / 2.0}[anchor]
        half = np.array([high, wide] if upright else [wide, high]) / 2.0
        middle = np.array([float(x) + shift, float(y)])
        boxes.append((text, np.array([middle - half, middle + half])))
    for x, y, text in re.findall(r'#balloon-at\(([-\d.]+)mm, ([-\d.]+)mm, "([^"]*)"\)', source):
        middle = np.array([float(x), float(y)])
        boxes.append((text, np.array([middle - 2.4, middle + 2.4])))
    assert len(boxes) == source.count("#label-at") + source.count("#balloon-at")
    return boxes


@pytest.mark.parametrize("design", [*map(studied_design, NAMES), *map(sharp_design, SHARP_NAMES), PROTOTYPE])
def test_no_words_of_a_drawing_overlap_or_leave_it(design: Design) -> None:
    for source in sheet_sources(design).values():
        (width,) = re.findall(r"drawing-width: ([\d.]+)mm", source)
        boxes = label_boxes(source)
        for text, (low, high) in boxes:
            assert (low > 1.0).all(), text
            assert (high < [float(width) - 1.0, 189.0]).all(), text
        for index, (text, (low, high)) in enumerate(boxes):
            for other, (least, most) in boxes[:index]:
                assert (high < least).any() or (most < low).any(), (text, other)


def test_a_mirror_without_a_hole_is_cut_in_one_piece_and_has_no_dimension_of_one() -> None:
    whole = sheet_sources(PROTOTYPE)["secondary"]
    assert PROTOTYPE.mirror("secondary").inner_radius_mm == 0.0
    # Outlines are thick polygons; arrowheads are thin ones.
    assert whole.count("polygon(stroke: 0.5mm") == 1
    assert sheet_sources(PROTOTYPE)["primary"].count("polygon(stroke: 0.5mm") == 2
    assert [text for text, _ in label_boxes(whole) if "⌀" in text] == ["⌀17.116"]


def test_a_clear_aperture_without_a_margin_is_the_face_and_said_to_be() -> None:
    design = sharp_design(SHARP_NAMES[0]).model_copy(update={"edge_margin_mm": None})
    for mirror in design.mirrors:
        words = printed_words(sheet_sources(design)[mirror.name])
        assert "the whole face" in words
        assert "clear ⌀" not in words


def test_near_spheres_are_said_to_be_near() -> None:
    """The secondaries of two winners depart from spheres by less than a micrometre; their primaries by far more."""
    for name in (SHARP_NAMES[0], SHARP_NAMES[4]):
        design = sharp_design(name)
        assert face_dimensions(design, "secondary").nearly == "sphere"
        assert face_dimensions(design, "primary").nearly == ""
    flat = design.mirrors[1].model_copy(update={"radius_mm": 1e6, "conic": 0.0, "kind": "ellipsoid"})
    almost = design.model_copy(update={"mirrors": (flat, *design.mirrors[::2])})
    assert face_dimensions(almost, "secondary").nearly == "plane"


def test_hatching_stays_inside_its_outline() -> None:
    """A ring's worth of corners: the hatching's length times its spacing is the outline's area."""
    angles = np.linspace(0.0, 1.5 * math.pi, 60)
    outline = [
        *((30 + 25 * math.cos(a), 30 + 25 * math.sin(a)) for a in angles),
        *((30 + 10 * math.cos(a), 30 + 10 * math.sin(a)) for a in angles[::-1]),
    ]
    points = np.array([line.points for line in hatched(outline, spacing=0.4)])
    distances = np.hypot(*(points - 30.0).reshape(-1, 2).T)
    assert distances.max() < 25.001
    # Lines of x + y = level, 0.4 apart in level, are 0.4 / sqrt(2) apart on paper.
    length = np.linalg.norm(points[:, 1] - points[:, 0], axis=1).sum()
    x, y = np.array(outline).T
    enclosed = 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
    assert length * 0.4 / math.sqrt(2.0) == pytest.approx(enclosed, rel=0.01)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"name": "Assembly"}, "the assembly's file has this name"),
        ({"outer_radius_mm": 1e7}, "drawn"),
        ({"radius_mm": 1e200}, "drawn"),
    ],
)
def test_what_no_sheet_holds_is_refused(changes: dict[str, object], words: str) -> None:
    design = studied_design(NAMES[0])
    mirror = design.mirrors[0].model_copy(update=changes)
    with pytest.raises(InputError, match=words):
        sheet_sources(design.model_copy(update={"mirrors": (mirror, *design.mirrors[1:])}))


def test_a_camera_that_no_sheet_holds_is_named() -> None:
    design = studied_design(NAMES[0])
    camera = design.camera.model_copy(update={"lens_front_mm": -1e300})
    with pytest.raises(InputError, match=r"camera\.lens_front_mm = -1e\+300: cannot be drawn"):
        sheet_sources(design.model_copy(update={"camera": camera}))


@NEEDS_TYPST
def test_words_that_no_font_has_and_words_that_typst_would_run_are_printed_as_words() -> None:
    design = sharp_design(SHARP_NAMES[1])
    odd = design.model_copy(update={"configuration": '日本 "#panic()" \\ $x$ ]', "variant": "#" * 300})
    assert all(pdf.startswith(b"%PDF") for pdf in drawing_sheets(odd).values())
