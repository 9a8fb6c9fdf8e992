"""Finding the image centre: exact to a few hundredths of a pixel where every truth is known."""

import numpy as np
import pytest

from designer.files import InputError
from designer.imaging.stereo.centring import find_centre
from designer.imaging.stereo.placement import ImagePlacement, centred
from support.analytic_room import Waves, eccentric_wall, raw_image
from support.imaging_designs import SIGNS, coarse_prototype, with_views

TEXTURE = Waves(finest_deg=1.6, coarsest_deg=24.0, count=60)


CENTRES = ((402.6, 297.2), (395.0, 304.0), (399.5, 299.5), (404.0, 303.3))


@pytest.mark.parametrize(("signs", "centre"), list(zip(SIGNS, CENTRES, strict=True)))
def test_the_centre_is_found_to_a_few_hundredths_of_a_pixel(signs, centre):
    design = with_views(coarse_prototype(), signs)
    placement = ImagePlacement(centre, 0.3, 0.99)
    raw = raw_image(design, eccentric_wall(1700.0, 0.6), TEXTURE, placement, noise=3.0)
    start = ImagePlacement(centred(design.camera).center_px, 0.3, 0.99)
    found = find_centre(design, raw, start)
    np.testing.assert_allclose(found.center_px, centre, atol=0.05)
    assert (found.rotation_rad, found.scale) == (0.3, 0.99)


def test_without_texture_there_is_no_centre_to_find():
    design = coarse_prototype()
    with pytest.raises(InputError, match="no centre found"):
        find_centre(design, np.full((600, 800), 90, np.uint8), centred(design.camera), reach_px=2.0)
