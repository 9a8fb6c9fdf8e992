"""What an end-to-end check says: in lines for the terminal, and as numbers for ``check.json``."""

from __future__ import annotations

from textwrap import wrap
from typing import TypedDict

import numpy as np

from designer.imaging.endtoend.bands import (
    LARGEST_BIAS,
    LARGEST_BIAS_SIGMAS,
    LARGEST_ERROR_RATIO,
    LARGEST_PART_RATIO,
    LEAST_ERROR_RATIO,
    LEAST_KEPT,
    LEAST_PART_RATIO,
    LEAST_TEXTURED,
    PARTS,
    Band,
)
from designer.imaging.endtoend.check import CheckWithControl, EndToEndCheck
from designer.imaging.endtoend.noise import BANDS, FEWEST_PIXELS, NORMAL_PER_MAD
from designer.imaging.render.lens import describe_lens
from designer.imaging.stereo.matching import MatchOutcome


class NoiseSummary(TypedDict):
    """Noise of an image point in raw pixels over elevations and distances; None where nothing was measured."""

    median: float | None
    least: float | None
    largest: float | None


class BandSummary(TypedDict):
    """A :class:`designer.imaging.endtoend.bands.Band` and its verdict; None for a number that does not exist."""

    distance_mm: tuple[float, float]
    pixels: int
    textured: int
    kept: float | None
    bias: float | None
    error: float | None
    error_ratio: float | None
    worst_part_ratio: float | None
    predicted: float | None
    bias_bound: float | None
    judged: bool
    problems: list[str]


class CheckSummary(TypedDict):
    """The numbers of a check in JSON's own types."""

    configuration: str
    scene: str
    texture: str
    recorded_through: str
    noise_px: NoiseSummary
    bands: list[BandSummary]
    definition: str
    passed: bool


class ComparisonSummary(TypedDict):
    """A design checked through its lens and through a pinhole, and the share of the pinhole's points that is left."""

    lens: CheckSummary
    pinhole: CheckSummary
    kept_of_pinhole: float | None
    passed: bool


def definition_of_passing() -> str:
    """What a check demands, in words."""
    return (
        f"passes if at least one of the {BANDS} distance bands has {FEWEST_PIXELS} or more pixels seen by both views "
        f"and, in each such band: at least {100 * LEAST_TEXTURED:g} % of those pixels have texture; the median depth "
        f"error is within {100 * LARGEST_BIAS:g} % of the distance or {LARGEST_BIAS_SIGMAS:g} of the predicted sigma, "
        f"whichever is larger; the robust RMS depth error ({NORMAL_PER_MAD:g} MAD) is {LEAST_ERROR_RATIO:g} to "
        f"{LARGEST_ERROR_RATIO:g} times the prediction, whose noise was measured on another scene, a ring of "
        f"textured walls, by elevation, distance and local contrast, and {LEAST_PART_RATIO:g} to "
        f"{LARGEST_PART_RATIO:g} times in each of {PARTS} parts in elevation; and at least {100 * LEAST_KEPT:g} % of "
        "the textured pixels are kept"
    )


def describe_check(check: EndToEndCheck) -> str:
    """The check in lines: a row for each band, what was dropped and why, the definition of passing, the verdict."""
    return "\n".join([*_lines(check), "", *wrap(definition_of_passing(), 110), "", _verdict(check)])


def describe_comparison(checks: CheckWithControl) -> str:
    """A check through a pinhole and the same through the design's lens, in lines; the plainest words come last."""
    pinhole, lens, share = checks.pinhole, checks.lens, checks.kept_of_pinhole
    left = "nothing to compare" if share is None else f"{100 * share:.3g} %"
    return "\n".join(
        [
            "Geometry, through a pinhole:",
            *_lines(pinhole),
            _verdict(pinhole),
            "",
            "Through the lens, with blur, diffraction, and light lost at mirrors and towards the rim:",
            *_lines(lens),
            _verdict(lens),
            "",
            *wrap(definition_of_passing(), 110),
            "",
            f"points seen by both views and reconstructed: {pinhole.points} through a pinhole, {lens.points} through "
            f"the lens ({left})",
            f"geometry {_verdict(pinhole)}, through the lens {_verdict(lens)}",
        ]
    )


def _lines(check: EndToEndCheck) -> list[str]:
    noise = check.noise.summary
    lines = [
        f"{check.configuration}, scene {check.scene}, {check.texture} texture, through {_recorded_through(check)}",
        f"noise of an image point, from the calibration scene: {noise['median']:.3f} px "
        f"({noise['least']:.3f} to {noise['largest']:.3f} over elevations and distances)",
        "",
        "distance (mm)    pixels   kept   median error (bound)   robust RMS error   predicted   ratio (worst part)",
    ]
    for band in check.bands:
        low, high = band.distance_mm
        numbers = (
            f"{100 * band.kept:5.1f} %   {100 * band.bias:+8.3f} % ({100 * band.bias_bound:.2f} %)   "
            f"{100 * band.error:14.3f} %   {100 * band.predicted:7.3f} %   {band.error_ratio:5.2f} "
            f"({band.worst_part_ratio:4.2f})"
        )
        words = f"FAILS: {', '.join(band.problems)}" if band.problems else "" if band.is_judged else "too few to judge"
        lines.append(f"{low:6.4g} - {high:<6.4g} {band.pixels:8d}  {numbers}   {words}".rstrip())
    counts = np.bincount(check.matches.outcomes[check.both_see], minlength=len(MatchOutcome))
    dropped = [
        f"{outcome.name.lower().replace('_', ' ')} {100 * counts[outcome] / max(1, counts.sum()):.1f} %"
        for outcome in MatchOutcome
        if outcome != MatchOutcome.KEPT and counts[outcome]
    ]
    return [*lines, "", f"rejected: {', '.join(dropped) or 'none'}"]


def _verdict(check: EndToEndCheck) -> str:
    untested = ", ".join("{:.4g} to {:.4g} mm".format(*band.distance_mm) for band in check.untested)
    return ("passed" if check.passed else "FAILED") + (f" (not tested: {untested})" if untested else "")


def _recorded_through(check: EndToEndCheck) -> str:
    return "a pinhole" if check.lens is None else describe_lens(check.rig.design.camera)


def summarise_check(check: EndToEndCheck) -> CheckSummary:
    """The check's numbers in plain types, for JSON."""
    noise = check.noise.summary
    return {
        "configuration": check.configuration,
        "scene": check.scene,
        "texture": check.texture,
        "recorded_through": _recorded_through(check),
        "noise_px": {
            "median": _number(noise["median"]),
            "least": _number(noise["least"]),
            "largest": _number(noise["largest"]),
        },
        "bands": [_summarise_band(band) for band in check.bands],
        "definition": definition_of_passing(),
        "passed": check.passed,
    }


def summarise_comparison(checks: CheckWithControl) -> ComparisonSummary:
    """The numbers of both checks in plain types, for JSON; passed if both are."""
    return {
        "lens": summarise_check(checks.lens),
        "pinhole": summarise_check(checks.pinhole),
        "kept_of_pinhole": checks.kept_of_pinhole,
        "passed": checks.lens.passed and checks.pinhole.passed,
    }


def _summarise_band(band: Band) -> BandSummary:
    return {
        "distance_mm": band.distance_mm,
        "pixels": band.pixels,
        "textured": band.textured,
        "kept": _number(band.kept),
        "bias": _number(band.bias),
        "error": _number(band.error),
        "error_ratio": _number(band.error_ratio),
        "worst_part_ratio": _number(band.worst_part_ratio),
        "predicted": _number(band.predicted),
        "bias_bound": _number(band.bias_bound),
        "judged": band.is_judged,
        "problems": list(band.problems),
    }


def _number(value: float) -> float | None:
    return None if np.isnan(value) else value
