"""End-to-end checks, read back from a study's folder."""

from __future__ import annotations

import json
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, ValidationError

from designer.design import Design
from designer.files import InputError, describe_validation_error, read_text
from designer.imaging.endtoend.check_files import VERDICT, fingerprint

Image = NDArray[np.uint8]


class _Part(BaseModel):
    """Part of ``check.json``; further keys are left alone."""

    model_config = ConfigDict(frozen=True)


class CheckedBand(_Part):
    """The verdict on one band of distances, as it was written; numbers are None where nothing was kept."""

    distance_mm: tuple[float, float]
    judged: bool
    problems: tuple[str, ...]
    kept: float | None = None
    bias: float | None = None
    bias_bound: float | None = None
    error_ratio: float | None = None

    @property
    def passes(self) -> bool:
        """Whether there was enough to judge, and nothing failed."""
        return self.judged and not self.problems


class CheckedNoise(_Part):
    """The noise of an image point in each view, in pixels: its median over elevations and distances, and its range."""

    median: float | None = None
    least: float | None = None
    largest: float | None = None


class CheckVerdict(_Part):
    """The verdict of an end-to-end check, as ``check.json`` holds it; ``definition`` says what passing means."""

    configuration: str
    scene: str
    texture: str
    recorded_through: str = "a pinhole"
    kept_of_pinhole: float | None = None
    noise_px: CheckedNoise
    bands: tuple[CheckedBand, ...]
    definition: str
    passed: bool
    design_sha256: str

    @property
    def untested(self) -> tuple[CheckedBand, ...]:
        """Bands that showed too little for a verdict."""
        return tuple(band for band in self.bands if not band.judged)


class _Unchecked(_Part):
    reason: str
    design_sha256: str


AnyPart = TypeVar("AnyPart", bound=_Part)


@dataclass(frozen=True, slots=True, eq=False)
class CheckMaps:
    """What an end-to-end check measured at each pixel of the upper panorama, as ``check.npz`` holds it.

    Attributes
    ----------
    disparity
        Difference in row between the two panoramas (rows, columns), NaN where dropped.
    outcome
        Why each pixel was kept (0) or dropped (rows, columns): a ``MatchOutcome``.
    distance_mm, true_distance_mm
        Horizontal distance from the axis (rows, columns): measured, NaN where dropped; true, NaN where nothing is.
    predicted
        Standard deviation of the relative error that was predicted (rows, columns).
    both_see
        Whether both views see the point (rows, columns).
    azimuth_deg
        Azimuth of each column (columns,).
    elevation_upper_deg, elevation_lower_deg
        Elevation of each row (rows,), as each view has it.
    """

    disparity: NDArray[np.float64]
    outcome: NDArray[np.uint8]
    distance_mm: NDArray[np.float64]
    true_distance_mm: NDArray[np.float64]
    predicted: NDArray[np.float64]
    both_see: NDArray[np.bool_]
    azimuth_deg: NDArray[np.float64]
    elevation_upper_deg: NDArray[np.float64]
    elevation_lower_deg: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class CheckedDesign:
    """A design and its check: the verdict, images (rows, columns) and maps."""

    design: Design
    verdict: CheckVerdict
    raw: Image
    upper: Image
    lower: Image
    maps: CheckMaps

    @property
    def passed(self) -> bool:
        """Whether the design passed."""
        return self.verdict.passed

    @property
    def relative_error(self) -> NDArray[np.float64]:
        """(measured - true) / true distance, NaN where dropped or unknown."""
        return np.asarray(self.maps.distance_mm / self.maps.true_distance_mm - 1.0)


def read_check(folder: Path, design: Design) -> CheckedDesign | None:
    """Read a check's folder; None if there is no finished check there, or if it is another design's.

    Raises
    ------
    InputError
        A file is absent or cannot be understood: one line says which.
    """
    path = folder / VERDICT
    if not path.exists():
        return None
    verdict = _read_part(path, CheckVerdict)
    if verdict.design_sha256 != fingerprint(design):
        return None
    raw, upper, lower = (_read_grey(folder / f"{name}.png") for name in ("raw", "upper", "lower"))
    return CheckedDesign(design, verdict, raw, upper, lower, _read_maps(folder / "check.npz"))


def read_unchecked(path: Path, design: Design) -> str | None:
    """Why a design could not be checked; None if the file does not say so of this design."""
    if not path.exists():
        return None
    content = _read_part(path, _Unchecked)
    return content.reason if content.design_sha256 == fingerprint(design) else None


def _read_part(path: Path, kind: type[AnyPart]) -> AnyPart:
    try:
        return kind.model_validate(json.loads(read_text(path)))
    except json.JSONDecodeError as error:
        raise InputError(f"{path}: not JSON: {error.msg} at line {error.lineno}, column {error.colno}") from None
    except ValidationError as error:
        raise InputError(describe_validation_error(path, error)) from None


def _read_grey(path: Path) -> Image:
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE) if data else None
    if image is None:
        raise InputError(f"{path}: not a readable image")
    return np.asarray(image, dtype=np.uint8)


def _read_maps(path: Path) -> CheckMaps:
    try:
        with np.load(path, allow_pickle=False) as arrays:
            return CheckMaps(
                disparity=arrays["disparity"].astype(np.float64),
                outcome=arrays["outcome"].astype(np.uint8),
                distance_mm=arrays["distance_mm"].astype(np.float64),
                true_distance_mm=arrays["true_distance_mm"].astype(np.float64),
                predicted=arrays["predicted"].astype(np.float64),
                both_see=arrays["both_see"].astype(np.bool_),
                azimuth_deg=arrays["azimuth_deg"].astype(np.float64),
                elevation_upper_deg=arrays["elevation_upper_deg"].astype(np.float64),
                elevation_lower_deg=arrays["elevation_lower_deg"].astype(np.float64),
            )
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    except KeyError as error:
        raise InputError(f"{path}: {error.args[0]}") from None
    except (ValueError, EOFError, zipfile.BadZipFile):
        raise InputError(f"{path}: not a file of arrays (.npz)") from None
