"""Drawings of designs, images and sweeps, as the report makes them; each shows itself in a notebook."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from designer.extras import needs
from designer.files import InputError, write_atomically

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from designer.api.studies import SweepResult
    from designer.design import Design
    from designer.imaging.endtoend.check import EndToEndCheck
    from designer.imaging.endtoend.equalisation_experiment import EqualisationComparison
    from designer.imaging.images import Image
    from designer.imaging.stereo.reconstruction import PointCloud
    from designer.imaging.stereo.results import StereoResult
    from designer.imaging.stereo.rig import StereoRig

RASTER_DPI = 150
FORMATS = ("svg", "pdf", "png")


@dataclass(frozen=True, slots=True, eq=False)
class Drawing:
    """A finished figure, with the size on paper that it was drawn for.

    ``figure`` is Matplotlib's. A notebook shows it as vector graphics, or as pixels where ``is_raster``: for pictures
    and for very many points.
    """

    figure: Figure
    is_raster: bool = False

    def save(self, path: str | Path) -> None:
        """Write an SVG, PDF or PNG file, by the ending of its name.

        Raises
        ------
        InputError
            The name ends otherwise.
        """
        path = Path(path)
        kind = path.suffix.lower().removeprefix(".")
        if kind not in FORMATS:
            raise InputError(f"{path}: must end in .{', .'.join(FORMATS)}")
        write_atomically(path, self._bytes(kind))

    def _repr_svg_(self) -> str | None:
        return None if self.is_raster else self._bytes("svg").decode()

    def _repr_png_(self) -> bytes | None:
        return self._bytes("png") if self.is_raster else None

    def _bytes(self, kind: str) -> bytes:
        from designer.report.figures.style import report_style, svg_bytes

        with report_style():
            if kind == "svg":
                return svg_bytes(self.figure)
            stream = io.BytesIO()
            self.figure.savefig(stream, format=kind, dpi=RASTER_DPI)
            return stream.getvalue()


@needs("report")
def draw_cross_section(design: Design, width_mm: float = 170.0, height_mm: float = 102.0) -> Drawing:
    """The system cut along its axis, to scale, with traced rays: the upper view's on the right, the lower's left."""
    from designer.report.figures.cross_section import draw_cross_section as draw

    return _drawn(lambda: draw(design, width_mm, height_mm).figure)


@needs("report")
def draw_image_layout(design: Design, width_mm: float = 85.0, height_mm: float = 75.0) -> Drawing:
    """Where the two views fall on the camera's chip."""
    from designer.report.figures.image_layout import draw_image_layout as draw

    return _drawn(lambda: draw(design, width_mm, height_mm))


@needs("report")
def draw_resolution(design: Design, width_mm: float = 85.0, height_mm: float = 65.0) -> Drawing:
    """Pixels per degree of both views against elevation."""
    from designer.report.figures.resolution import draw_resolution as draw

    return _drawn(lambda: draw(design, width_mm, height_mm))


@needs("report")
def draw_virtual_images(*designs: Design, width_mm: float = 170.0, height_mm: float = 75.0) -> Drawing:
    """Depth of the virtual images behind the mirrors against image radius, a panel for each design, at best focus."""
    from designer.report.figures.virtual_images import draw_virtual_images as draw

    return _drawn(lambda: draw(designs, width_mm, height_mm))


@needs("report")
def draw_depth_error(design: Design, width_mm: float = 85.0, height_mm: float = 75.0) -> Drawing:
    """Relative depth error against distance, with traced points beside the closed form."""
    from designer.report.figures.depth_error import draw_depth_error as draw

    return _drawn(lambda: draw(design, width_mm, height_mm))


@needs("report")
def draw_depth_map(
    design: Design, image_circle_px: int = 400, width_mm: float = 120.0, height_mm: float = 75.0
) -> Drawing:
    """The point of every pair of pixels of one epipolar plane, for an image circle of so many pixels across."""
    from designer.report.figures.depth_map import draw_depth_map as draw

    return _drawn(lambda: draw(design, width_mm, height_mm, image_circle_px), is_raster=True)


@needs("report")
def draw_single_mirror_principles(width_mm: float = 170.0, height_mm: float = 70.0) -> Drawing:
    """One viewpoint from one mirror, hyperboloid or ellipsoid, and from a pair of paraboloids."""
    from designer.report.figures.principles import draw_single_mirror_principles as draw

    return _drawn(lambda: draw(width_mm, height_mm))


@needs("report")
def draw_folded_principle(width_mm: float = 80.0, height_mm: float = 75.0) -> Drawing:
    """One viewpoint from two conics, the second of which folds the light back."""
    from designer.report.figures.principles import draw_folded_principle as draw

    return _drawn(lambda: draw(width_mm, height_mm))


@needs("report")
def draw_raw(image: Image, width_mm: float = 140.0) -> Drawing:
    """A raw image."""
    from designer.report.figures.imaging import draw_raw as draw

    return _drawn(lambda: draw(_red_green_blue(image), width_mm), is_raster=True)


@needs("report")
def draw_kernels(rig: StereoRig, image: Image, width_mm: float = 140.0) -> Drawing:
    """A raw image with the equalising kernels of both views, enlarged twelve times.

    Raises
    ------
    InputError
        The rig does not equalise.
    """
    from designer.report.figures.imaging import draw_kernels as draw

    if rig.sigma_px is None:
        raise InputError("this rig was built without equalisation: use equalise=True")
    return _drawn(lambda: draw(rig, _red_green_blue(image), width_mm), is_raster=True)


@needs("report")
def draw_panoramas(found: StereoResult | EndToEndCheck, width_mm: float = 220.0) -> Drawing:
    """Both panoramas, and the disparities in colours: near is bright, dropped is black."""
    from designer.report.figures.imaging import disparity_colours
    from designer.report.figures.imaging import draw_panoramas as draw

    pictures = {
        "upper view": _red_green_blue(found.upper),
        "lower view": _red_green_blue(found.lower),
        "disparity": disparity_colours(found.matches),
    }
    return _drawn(lambda: draw(found.rig.grid, pictures, width_mm), is_raster=True)


@needs("report")
def draw_equalisation(
    compared: EqualisationComparison, columns: tuple[int, int] | None = None, width_mm: float = 200.0
) -> Drawing:
    """What reverse verification rejected (black) in panoramas sampled three ways, between two columns."""
    from designer.report.figures.imaging import draw_comparison

    everything = (0, len(compared.matches["equalised"].outcomes))
    return _drawn(lambda: draw_comparison(compared, slice(*(columns or everything)), width_mm), is_raster=True)


@needs("report")
def draw_point_cloud(
    cloud: PointCloud,
    design: Design,
    azimuth_deg: float = 0.0,
    elevations_deg: Sequence[float] = (0.0, 25.0, 60.0),
    width_mm: float = 220.0,
) -> Drawing:
    """Points seen along an azimuth from several elevations, around a place ahead of the design."""
    from designer.report.figures.imaging import draw_views_of_cloud as draw

    middle_mm = design.views.middle_mm
    return _drawn(lambda: draw(cloud, middle_mm, azimuth_deg, elevations_deg, width_mm), is_raster=True)


@needs("report")
def draw_floor_plan(
    cloud: PointCloud, heights_mm: tuple[float, float], extent_mm: float, width_mm: float = 110.0
) -> Drawing:
    """Points between two heights z, seen from above, up to a distance from the axis."""
    from designer.imaging.stereo.cloud import floor_plan
    from designer.report.figures.imaging import draw_plan as draw

    return _drawn(lambda: draw(floor_plan(cloud, heights_mm, extent_mm), width_mm), is_raster=True)


@needs("report")
def draw_winner_map(swept: SweepResult, width_mm: float = 120.0) -> Drawing:
    """Which configuration wins where in a sweep, by letters and colours.

    Raises
    ------
    InputError
        Nothing is feasible in the sweep.
    """
    from designer.report.figures.sweep import draw_winner_map as draw
    from designer.report.figures.sweep import letters_of

    if swept.winners.empty:
        raise InputError(f"{swept.folder}: this sweep has no feasible design, so there are no winners to draw")
    return _drawn(lambda: draw(swept.winners, swept.table[swept.axes], letters_of(swept.winners), width_mm))


def _drawn(draw: Callable[[], Figure], *, is_raster: bool = False) -> Drawing:
    from designer.report.figures.style import report_style

    with report_style():
        return Drawing(draw(), is_raster)


def _red_green_blue(image: Image) -> Image:
    """A grey image as it is, one in OpenCV's order of colours in Matplotlib's."""
    return image if image.ndim == 2 else image[..., ::-1]
