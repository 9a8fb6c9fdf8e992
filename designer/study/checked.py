"""End-to-end checks, read back from a study's folder."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, ValidationError

from designer.design import Design
from designer.files import InputError, describe_validation_error, read_text
from designer.imaging.endtoend.files import VERDICT, fingerprint

Image = NDArray[np.uint8]

_MAPS = (
    "disparity",
    "outcome",
    "distance_mm",
    "true_distance_mm",
    "predicted",
    "both_see",
    "azimuth_deg",
    "elevation_upper_deg",
    "elevation_lower_deg",
)


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
class CheckedDesign:
    """A design and its check: the verdict, images, and maps (rows, columns) by name."""

    design: Design
    verdict: CheckVerdict
    raw: Image
    upper: Image
    lower: Image
    maps: Mapping[str, NDArray[Any]]

    @property
    def passed(self) -> bool:
        """Whether the design passed."""
        return self.verdict.passed

    @property
    def relative_error(self) -> NDArray[np.float64]:
        """(measured - true) / true distance, NaN where dropped or unknown."""
        return np.asarray(self.maps["distance_mm"].astype(float) / self.maps["true_distance_mm"] - 1.0)


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


def _read_maps(path: Path) -> dict[str, NDArray[Any]]:
    try:
        with np.load(path, allow_pickle=False) as arrays:
            return {name: arrays[name] for name in _MAPS}
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    except KeyError as error:
        raise InputError(f"{path}: {error.args[0]}") from None
    except (ValueError, EOFError, zipfile.BadZipFile):
        raise InputError(f"{path}: not a file of arrays (.npz)") from None
