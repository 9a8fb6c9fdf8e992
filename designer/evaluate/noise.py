"""How precisely a point can be matched: texture, blur, light and window in closed form (docs/theory.md, section 12).

Blur is that of both views where they meet, in mm on a surface parallel to the axis: along the meridian and across it,
as standard deviations. Every function takes floats, NumPy arrays or CasADi symbols; lengths in mm on the sensor or on
the surface.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from designer.design import PerView
from designer.optics.backend import Scalar, exp, sqrt

# Contrast of an octave in rendered scenes, with wavelengths as shares of their extent: eight octaves of 0.3 together,
# squeezed into -1 to 1 (see the tests).
RICH_CONTRAST_PER_OCTAVE = 0.0984
FINEST_WAVELENGTH, COARSEST_WAVELENGTH = 0.2 / 2.0**8, 0.2
# Gradient energy through a perfect round lens equals that through a Gaussian of this times lambda N (see the tests).
DIFFRACTION_SIGMA = 0.4695
# An area of one square pixel, evenly sensitive.
PIXEL_VARIANCE = 1.0 / 12.0
# Density of aliasing at low wave numbers in pixels, over C^2 q^2, and what higher wave numbers add to its effect.
ALIASING_DENSITY = 1.08 / (16.0 * np.pi**5)
ALIASING_BEYOND = 1.9
# Error from unequal blur, over the difference of variances per side of the window (see the tests).
EDGE_ALONG, EDGE_ACROSS = 0.32, 0.5
# Half-width of the rounded corner of the smooth maximum, relative.
_ROUNDING = 0.05


@dataclass(frozen=True, slots=True)
class TextureSpectrum:
    """What surfaces show: rms contrast of each octave relative to their tone, between two wavelengths in mm."""

    contrast_per_octave: Scalar
    finest_mm: Scalar
    coarsest_mm: Scalar


@dataclass(frozen=True, slots=True)
class CollectedLight:
    """What a pixel collects.

    ``electrons_of_white`` arrive from radiance 1, which fills the scale, at ``f_number``; other f-numbers collect as
    1 / N^2. ``tone`` is the radiance of a typical surface and ``grey_levels`` the largest number of the scale.
    """

    electrons_of_white: Scalar
    f_number: float
    read_noise_electrons: float
    tone: float = 0.33
    grey_levels: float = 255.0


@dataclass(frozen=True, slots=True)
class MatcherPerformance:
    """How a matcher works, and what it makes of its windows, as ``benchmarks/noise.py`` measures it.

    ``window`` is the side of its window in panorama pixels, ``columns`` the width of the panorama. ``efficiency`` is
    the variance of plain least squares over that measured. ``edge_loss`` multiplies the error from unequal blur,
    and ``slant_loss`` is what each row by which the window is shorter in one view than in the other adds to the
    standard deviation, relative. ``floor`` in rows is what is left without noise, aliasing and unequal blur.
    """

    window: int = 9
    columns: int = 1800
    efficiency: float = 0.78
    edge_loss: float = 2.6
    slant_loss: float = 0.87
    floor: float = 0.05


Matcher = Literal["sad", "semi_global"]
# Both as refined by windows that follow the surface. Semi-global matching differs in what it keeps, hardly in noise.
MATCHER_PERFORMANCE: dict[Matcher, MatcherPerformance] = {
    "sad": MatcherPerformance(),
    "semi_global": MatcherPerformance(efficiency=0.81),
}


@dataclass(frozen=True, slots=True)
class ImagePoint:
    """Where and how one view images a point.

    ``slope`` is tan(phi) at the viewpoint, ``radius`` and ``radius_slope`` are r in mm and dr/dphi in mm per radian,
    of either sign, and ``defocus`` is the diameter of the blur disc in mm on the sensor, of either sign.
    ``illumination`` is the share of the light on the axis that arrives there. ``stretch`` is what a lens that is not
    perspective stretches the disc by, along the radius and across it; None for none.
    """

    slope: Scalar
    radius: Scalar
    radius_slope: Scalar
    defocus: Scalar
    illumination: Scalar = 1.0
    stretch: tuple[Scalar, Scalar] | None = None


@dataclass(frozen=True, slots=True)
class CameraSetting:
    """What the camera does to both views: pixel pitch in mm, f-number, and wavelength in mm (0: no diffraction).

    ``equalising_sigma_px`` is the reference sigma of equalisation in raw pixels (:func:`equalising_sigma_px`).
    """

    pixel_pitch: float
    f_number: Scalar
    equalising_sigma_px: Scalar = 0.5
    wavelength: float = 0.0


def rich_texture(extent_mm: Scalar) -> TextureSpectrum:
    """The texture called rich of rendered scenes of that extent in mm: their farthest working distance."""
    return TextureSpectrum(RICH_CONTRAST_PER_OCTAVE, FINEST_WAVELENGTH * extent_mm, COARSEST_WAVELENGTH * extent_mm)


def texture_gradient_energy(texture: TextureSpectrum, along: Scalar, across: Scalar) -> Scalar:
    """Mean squared gradient, per mm^2, of the relative contrast along the meridian.

    Parameters
    ----------
    along, across
        Standard deviations of the blur in mm on the surface.
    """
    squared = along * (along + across) / 2.0
    fine, coarse = ((2.0 * np.pi / wavelength) ** 2 for wavelength in (texture.finest_mm, texture.coarsest_mm))
    lost = fine * _dawson_remainder(fine * squared) - coarse * _dawson_remainder(coarse * squared)
    return texture.contrast_per_octave**2 / (4.0 * np.log(2.0)) * lost


def blur_variance(exposure: CameraSetting, defocus: Scalar) -> Scalar:
    """Variance along either axis, in mm^2 on the sensor, of defocus (disc diameter in mm), diffraction and pixel."""
    diffraction = DIFFRACTION_SIGMA * exposure.wavelength * exposure.f_number
    return defocus * defocus / 16.0 + diffraction * diffraction + PIXEL_VARIANCE * exposure.pixel_pitch**2


def pixel_variance(light: CollectedLight, f_number: Scalar, illumination: Scalar = 1.0) -> Scalar:
    """Variance of a raw pixel in units of its signal squared: shot noise, read noise, quantisation.

    ``illumination`` is the share of the light on the axis that reaches the pixel.
    """
    ratio = f_number / light.f_number
    electrons = illumination * light.tone * light.electrons_of_white / (ratio * ratio)
    return 1.0 / electrons + (light.read_noise_electrons / electrons) ** 2 + rounding_variance(light, illumination)


def rounding_variance(light: CollectedLight, illumination: Scalar = 1.0) -> Scalar:
    """Variance of rounding to whole grey levels, in units of the signal squared."""
    levels = illumination * light.grey_levels * light.tone
    return 1.0 / (12.0 * levels * levels)


def equalising_sigma_px(largest_common_spacing_px: Scalar) -> Scalar:
    """The reference sigma of equalisation: half a raw pixel, or half a panorama pixel where that is more.

    Parameters
    ----------
    largest_common_spacing_px
        Raw pixels from one panorama pixel to the next, 2 pi / columns times |dr/dphi| or |r| in pixels: of the
        smaller of the two views, at the elevation where it is largest.
    """
    return 0.5 * _smooth_maximum(1.0, largest_common_spacing_px)


def matching_noise(
    points: PerView[ImagePoint],
    distance: Scalar,
    texture: TextureSpectrum,
    light: CollectedLight,
    exposure: CameraSetting,
    matching: MatcherPerformance,
) -> PerView[Scalar]:
    """Standard deviation, in mm on the sensor, of a matched point's radial position in each view.

    The two are independent parts of the error of one match: its depth error is that of
    :func:`designer.evaluate.depth.slope_error` for the one and the other view, added in quadrature.

    Parameters
    ----------
    distance
        Horizontal distance of the point from the axis in mm.
    """
    seen = seen_on_surface(points, distance, light, exposure, matching)
    mean_along, mean_across, template = seen.mean_along, seen.mean_across, seen.template
    signal = texture_gradient_energy(texture, sqrt(mean_along + template / 2.0), sqrt(mean_across))
    weight = texture_gradient_energy(texture, sqrt(mean_along + template), sqrt(mean_across))
    scale = seen.loss / (seen.area * signal * signal)
    noises = []
    for view in (seen.views.upper, seen.views.lower):
        rounding = view.rounding * seen.row * seen.column * weight
        total_along, total_across = mean_along + template + view.smoothing, mean_across + seen.across_smoothing
        smoothed = texture_gradient_energy(texture, sqrt(total_along), sqrt(total_across))
        aliased = _aliasing(
            texture,
            view.pixel,
            view.mean_blur / exposure.pixel_pitch**2 - PIXEL_VARIANCE,
            total_along,
            total_across,
        )
        variance = scale * (view.raw * view.pixel * smoothed + rounding + aliased) + (seen.edge + seen.floor) / 2.0
        noises.append(sqrt(variance / view.scale_along))
    return PerView(upper=noises[0], lower=noises[1])


@dataclass(frozen=True, slots=True)
class ViewOnSurface:
    """What one view of a match brings to its noise; areas in mm^2 on the surface unless they are the sensor's.

    ``scale_along`` is the squared length on the surface of one mm along the radius on the sensor, ``pixel`` the area of
    a raw pixel, ``smoothing`` the variance along the meridian that equalisation adds, ``mean_blur`` the variance of all
    blur on the sensor. ``raw`` and ``rounding`` are variances relative to the signal squared: of a raw pixel, and of
    the panorama's own rounding.
    """

    scale_along: Scalar
    pixel: Scalar
    smoothing: Scalar
    mean_blur: Scalar
    raw: Scalar
    rounding: Scalar


@dataclass(frozen=True, slots=True)
class SurfaceSeen:
    """A point's surroundings as both views of a match have them: all that its noise depends on.

    Variances in mm^2 on the surface: ``mean_along`` and ``mean_across`` the meridian of all blur, mean of both views,
    ``template`` of the gradient that weighs the window, ``across_smoothing`` of equalisation. ``row`` and ``column``
    are a panorama pixel's sides in mm, ``area`` the window's. ``loss`` is what the matcher and the slant of the surface
    cost. ``edge`` and ``floor`` are variances in mm^2 of the shift itself: from unequal blur, and what is always left.
    """

    views: PerView[ViewOnSurface]
    mean_along: Scalar
    mean_across: Scalar
    across_smoothing: Scalar
    template: Scalar
    row: Scalar
    column: Scalar
    area: Scalar
    loss: Scalar
    edge: Scalar
    floor: Scalar


def seen_on_surface(
    points: PerView[ImagePoint],
    distance: Scalar,
    light: CollectedLight,
    exposure: CameraSetting,
    matching: MatcherPerformance,
) -> SurfaceSeen:
    """What both views make of a point's surroundings; parameters as of :func:`matching_noise`."""
    views = (points.upper, points.lower)
    step = 2.0 * np.pi / matching.columns
    stretch = [1.0 + view.slope * view.slope for view in views]
    # Squared lengths on the surface of one mm on the sensor, along and across the meridian.
    along_scale = [(distance * s / view.radius_slope) ** 2 for s, view in zip(stretch, views, strict=True)]
    across_scale = [(distance / view.radius) ** 2 for view in views]
    # Equalisation gives both views the smoothing, in angles, of the one that resolves less.
    sigma = exposure.equalising_sigma_px * exposure.pixel_pitch
    angle = _smooth_maximum(*(along / (s * s) for along, s in zip(along_scale, stretch, strict=True)))
    along_smoothing = [sigma * sigma * s * s * angle for s in stretch]
    across_smoothing = sigma * sigma * _smooth_maximum(*across_scale)
    blurs = [_blur_variances(exposure, view) for view in views]
    along = [blur[0] * scale + h for blur, scale, h in zip(blurs, along_scale, along_smoothing, strict=True)]
    across = [blur[1] * scale + across_smoothing for blur, scale in zip(blurs, across_scale, strict=True)]

    row, column = step * distance * stretch[0], step * distance
    excess = matching.slant_loss * matching.window * (stretch[0] - stretch[1])
    on_surface = []
    for view, scale_along, scale_across, smoothing, blur in zip(
        views, along_scale, across_scale, along_smoothing, blurs, strict=True
    ):
        on_surface.append(
            ViewOnSurface(
                scale_along,
                sqrt(scale_along * scale_across) * exposure.pixel_pitch**2,
                smoothing,
                blur[0] if view.stretch is None else (blur[0] + blur[1]) / 2.0,
                pixel_variance(light, exposure.f_number, view.illumination),
                # A panorama is rounded as bright as it was recorded; evening out the brightness comes afterwards.
                rounding_variance(light, view.illumination),
            )
        )
    return SurfaceSeen(
        PerView(upper=on_surface[0], lower=on_surface[1]),
        (along[0] + along[1]) / 2.0,
        (across[0] + across[1]) / 2.0,
        across_smoothing,
        # The gradient that weighs the window is the difference over two rows.
        row * row / 3.0,
        row,
        column,
        matching.window**2 * row * column,
        (1.0 + excess * excess / (stretch[0] * stretch[1])) / matching.efficiency,
        matching.edge_loss**2 * _edge_variance(along, across, matching.window * row, matching.window * column),
        (matching.floor * row) ** 2,
    )


def _blur_variances(exposure: CameraSetting, view: ImagePoint) -> tuple[Scalar, Scalar]:
    """Variance of all blur on the sensor, mm^2, along the radius and across it."""
    if view.stretch is None:
        same = blur_variance(exposure, view.defocus)
        return same, same
    along, across = view.stretch
    return blur_variance(exposure, view.defocus * along), blur_variance(exposure, view.defocus * across)


def _aliasing(texture: TextureSpectrum, pixel: Scalar, lens_blur_px2: Scalar, along: Scalar, across: Scalar) -> Scalar:
    """What aliasing adds where white noise adds variance times pixel times gradient energy; ``pixel`` in mm^2.

    ``along`` and ``across`` are variances in mm^2 of template and noise after all smoothing.
    """
    power = texture.contrast_per_octave**2 / np.log(2.0)
    after = sqrt(along * across) / pixel
    both = after + lens_blur_px2
    lens = (2.0 * np.pi) ** 2 * lens_blur_px2 * after / both
    passed = exp(-lens) * (1.0 + lens * lens_blur_px2 / both) * (both / after) ** 3
    # Nothing is there to be folded down where the finest wavelength is longer than a pixel.
    coarseness = (texture.finest_mm**2 / pixel) ** 4
    density = ALIASING_DENSITY * ALIASING_BEYOND * power * pixel * pixel * passed / (1.0 + coarseness)
    return np.pi**2 * power * density / (along * sqrt(along * across))


def _edge_variance(along: list[Scalar], across: list[Scalar], row_side: Scalar, column_side: Scalar) -> Scalar:
    """Variance in mm^2 of a shift that comes from blurs of unequal variances (mm^2) along and across the meridian."""
    of_along = EDGE_ALONG * (along[0] - along[1])
    of_across = EDGE_ACROSS * (across[0] - across[1])
    return of_along * of_along / (row_side * row_side) + of_across * of_across / (row_side * column_side)


def _dawson_remainder(y: Scalar) -> Scalar:
    """(1 - A(y)) / y with A(y) = F(sqrt y) / sqrt y, within 1.3 percent.

    From the third convergent of Dawson's continued fraction.
    """
    return (70.0 + y * (32.0 + 8.0 * y)) / (105.0 + y * (90.0 + y * (36.0 + 8.0 * y)))


def _smooth_maximum(first: Scalar, second: Scalar) -> Scalar:
    """The larger of two positive values; at most half of ``_ROUNDING`` above it where they are equal."""
    difference, both = first - second, _ROUNDING * (first + second) / 2.0
    return (first + second + sqrt(difference * difference + both * both)) / 2.0
