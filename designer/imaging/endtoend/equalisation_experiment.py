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

from designer.design import VIEW_NAMES
from designer.imaging.images import Image
from designer.imaging.stereo.equalisation import ScaleFactors, build_equaliser
from designer.imaging.stereo.matching import Matches, MatchingOptions, MatchOutcome, match
from designer.imaging.stereo.panorama import AZIMUTH_PADDING
from designer.imaging.stereo.rig import StereoRig, sample

Method = Literal["bilinear", "smoothed_alike", "equalised"]
METHODS: tuple[Method, ...] = ("bilinear", "smoothed_alike", "equalised")

# Without a threshold of contrast: smoothing lowers contrast, and what is dropped for it would not be rejected.
OPTIONS = MatchingOptions(least_contrast=0.0)

_NOISE_LEVELS = 25.0
_SIGMA_RANGE_PX = (0.42, 8.0)


@dataclass(frozen=True, slots=True, eq=False)
class EqualisationComparison:
    """One raw image sampled in three ways: panoramas as scan lines (columns + padding, rows), and matches."""

    upper: Mapping[Method, Image]
    lower: Mapping[Method, Image]
    matches: Mapping[Method, Matches]

    @property
    def rejected(self) -> dict[Method, int]:
        """How many pixels reverse verification rejected."""
        return {
            method: int(np.sum(found.outcomes == MatchOutcome.REVERSE_CHECK)) for method, found in self.matches.items()
        }


def sampling_methods(equalised: StereoRig) -> dict[Method, StereoRig]:
    """The rig with plain bilinear sampling, with both views smoothed alike to the same noise gain, and as it is.

    Parameters
    ----------
    equalised
        A rig built with ``equalise=True``.
    """
    control = _smoothed_alike(equalised, control_sigma_px(equalised))
    bilinear = replace(equalised, equalisers=None, sigma_px=None)
    return {"bilinear": bilinear, "smoothed_alike": control, "equalised": equalised}


def compare_methods(methods: Mapping[Method, StereoRig], raw: Image) -> EqualisationComparison:
    """Match one grey raw image sampled in each way."""
    lines = {method: sample(rig, raw) for method, rig in methods.items()}
    matches = {
        method: match(rig.grid, rig.search, lines[method]["upper"], lines[method]["lower"], rig.imaged, OPTIONS)
        for method, rig in methods.items()
    }
    upper = {method: views["upper"] for method, views in lines.items()}
    return EqualisationComparison(upper, {method: views["lower"] for method, views in lines.items()}, matches)


def noise_gain(rig: StereoRig) -> float:
    """Standard deviation of the panoramas' pixels, both views together, over that of white noise in the raw image."""
    camera = rig.design.camera
    noise = np.random.default_rng(0).standard_normal((camera.height_px, camera.width_px))
    raw = np.asarray(np.clip(np.rint(128.0 + _NOISE_LEVELS * noise), 0, 255), dtype=np.uint8)
    inner = slice(AZIMUTH_PADDING, -AZIMUTH_PADDING)
    variances = [float(np.var(lines[inner].astype(float))) for lines in sample(rig, raw).values()]
    return float(np.sqrt(np.mean(variances)) / _NOISE_LEVELS)


def control_sigma_px(equalised: StereoRig) -> float:
    """The sigma (raw pixels) of one Gaussian for both views whose noise gain is that of an equalised rig."""
    wanted = noise_gain(equalised)

    def excess(sigma: float) -> float:
        return noise_gain(_smoothed_alike(equalised, sigma)) - wanted

    return float(brentq(excess, *_SIGMA_RANGE_PX, xtol=5e-3))


def _smoothed_alike(rig: StereoRig, sigma_px: float) -> StereoRig:
    """The rig with both views smoothed by one Gaussian of the raw image."""
    ones = np.ones(rig.grid.rows)
    factors = ScaleFactors(ones, ones)
    equalisers = {view: build_equaliser(rig.grid, rig.images[view], view, factors, sigma_px) for view in VIEW_NAMES}
    return replace(rig, equalisers=equalisers, sigma_px=sigma_px)
