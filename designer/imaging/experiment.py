"""The paper's claim about resolution equalisation (figure 10), with a control.

The claim: of panoramas whose resolutions were equalised, reverse verification rejects fewer pixels than of panoramas
sampled bilinearly. Equalising also smooths, and smoothing alone takes noise away; so a third pair of panoramas is
matched, both views smoothed by one and the same Gaussian of the raw image, as wide as gives the same noise gain.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.optimize import brentq

from designer.evaluate.resolution import VIEW_NAMES
from designer.imaging.equalisation import ScaleFactors, build_equaliser
from designer.imaging.matching import Matches, MatchingOptions, Outcome, match
from designer.imaging.panorama import AZIMUTH_PADDING, Image
from designer.imaging.sensor import Sensor, sample

Method = Literal["bilinear", "smoothed_alike", "equalised"]
METHODS: tuple[Method, ...] = ("bilinear", "smoothed_alike", "equalised")

# Without a threshold of contrast: smoothing lowers contrast, and what is dropped for it would not be rejected.
OPTIONS = MatchingOptions(least_contrast=0.0)

_NOISE_LEVELS = 25.0
_SIGMA_RANGE_PX = (0.42, 8.0)


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """One raw image sampled in three ways: panoramas as scan lines (columns + padding, rows), and matches."""

    upper: Mapping[Method, Image]
    lower: Mapping[Method, Image]
    matches: Mapping[Method, Matches]

    @property
    def rejected(self) -> dict[Method, int]:
        """How many pixels reverse verification rejected."""
        return {method: int(np.sum(found.outcomes == Outcome.REVERSE_CHECK)) for method, found in self.matches.items()}


def sampling_methods(equalised: Sensor) -> dict[Method, Sensor]:
    """The sensor with plain bilinear sampling, with both views smoothed alike to the same noise gain, and as it is.

    Parameters
    ----------
    equalised
        A sensor built with ``equalise=True``.
    """
    control = _smoothed_alike(equalised, control_sigma_px(equalised))
    bilinear = replace(equalised, equalisers=None, sigma_px=None)
    return {"bilinear": bilinear, "smoothed_alike": control, "equalised": equalised}


def compare(methods: Mapping[Method, Sensor], raw: Image) -> Comparison:
    """Match one grey raw image sampled in each way."""
    lines = {method: sample(sensor, raw) for method, sensor in methods.items()}
    matches = {
        method: match(
            sensor.grid, sensor.search, lines[method]["upper"], lines[method]["lower"], sensor.imaged, OPTIONS
        )
        for method, sensor in methods.items()
    }
    upper = {method: views["upper"] for method, views in lines.items()}
    return Comparison(upper, {method: views["lower"] for method, views in lines.items()}, matches)


def noise_gain(sensor: Sensor) -> float:
    """Standard deviation of the panoramas' pixels, both views together, over that of white noise in the raw image."""
    camera = sensor.design.camera
    noise = np.random.default_rng(0).standard_normal((camera.height_px, camera.width_px))
    raw = np.asarray(np.clip(np.rint(128.0 + _NOISE_LEVELS * noise), 0, 255), dtype=np.uint8)
    inner = slice(AZIMUTH_PADDING, -AZIMUTH_PADDING)
    variances = [float(np.var(lines[inner].astype(float))) for lines in sample(sensor, raw).values()]
    return float(np.sqrt(np.mean(variances)) / _NOISE_LEVELS)


def control_sigma_px(equalised: Sensor) -> float:
    """The sigma (raw pixels) of one Gaussian for both views whose noise gain is that of an equalised sensor."""
    wanted = noise_gain(equalised)

    def excess(sigma: float) -> float:
        return noise_gain(_smoothed_alike(equalised, sigma)) - wanted

    return float(brentq(excess, *_SIGMA_RANGE_PX, xtol=5e-3))


def _smoothed_alike(sensor: Sensor, sigma_px: float) -> Sensor:
    """The sensor with both views smoothed by one Gaussian of the raw image."""
    ones = np.ones(sensor.grid.rows)
    factors = ScaleFactors(ones, ones)
    equalisers = {
        view: build_equaliser(sensor.grid, sensor.images[view], view, factors, sigma_px) for view in VIEW_NAMES
    }
    return replace(sensor, equalisers=equalisers, sigma_px=sigma_px)
