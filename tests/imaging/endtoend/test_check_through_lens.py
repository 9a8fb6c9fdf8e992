"""The check through a design's own lens: a sharp one keeps most of what a pinhole keeps, a blurred one does not."""

from __future__ import annotations

import pytest

from designer.design import read_design
from designer.imaging.endtoend.check import CheckOptions, check_design, through_lens
from designer.imaging.endtoend.description import describe_comparison, kept_of_pinhole, summarise_comparison
from support import DATA
from support.studied_designs import studied_design

# Blurred over 8 pixels at most, 0.75 degrees in the scene, where its study has focused it.
SHARP = "pipe_inspection:folded-HyHy-Hy-upper_outer"


@pytest.mark.slow
def test_a_sharp_design_passes_through_its_lens_and_keeps_most_of_what_a_pinhole_keeps() -> None:
    design, options = studied_design(SHARP), CheckOptions()
    pinhole, lens = check_design(design, options), check_design(design, through_lens(options))
    assert pinhole.passed, describe_comparison(pinhole, lens)
    assert lens.passed, describe_comparison(pinhole, lens)
    share = kept_of_pinhole(pinhole, lens)
    assert share is not None
    # 0.864: light lost at mirrors, levelled brightness and diffraction cost points too.
    assert share >= 0.8
    assert summarise_comparison(pinhole, lens)["passed"]


@pytest.mark.slow
def test_the_prototype_focused_at_infinity_is_told_that_it_is_blurred() -> None:
    design, options = read_design(DATA / "folded_hypl_hy.json"), CheckOptions()
    pinhole, lens = check_design(design, options), check_design(design, through_lens(options))
    assert pinhole.passed
    assert not lens.passed
    share = kept_of_pinhole(pinhole, lens)
    assert share is not None
    assert share < 0.2
    *_, last = describe_comparison(pinhole, lens).splitlines()
    assert last == "geometry passed, through the lens FAILED"
    assert not summarise_comparison(pinhole, lens)["passed"]
