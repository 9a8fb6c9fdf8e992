"""Formats whose cameras are perspective refuse a lens that is not, with the reason; those of mirrors alone do not."""

import pytest

from designer.export.formats import EXPORTS
from designer.files import InputError
from support.wide_designs import LAWS, wide_design


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("name", ["zmx", "optiland", "povray"])
def test_formats_with_a_perspective_camera_refuse(law, name):
    design = wide_design(law)
    reason = "images r = f tan\\(psi\\)|a pinhole before a flat image plane"
    with pytest.raises(InputError, match=f"^camera.projection: .*{design.camera.projection} projection.*({reason})$"):
        EXPORTS[name].contents(design)


@pytest.mark.parametrize("law", LAWS)
def test_formats_of_mirrors_alone_hold_any(law):
    assert len(EXPORTS["sag"].contents(wide_design(law))) == len(wide_design(law).mirrors)


def test_coefficients_of_zero_are_no_distortion():
    design = wide_design("perspective+distortion")
    plain = design.model_copy(update={"camera": design.camera.model_copy(update={"distortion": (0.0, 0.0)})})
    assert set(EXPORTS["zmx"].contents(plain)) == {"upper", "lower"}
