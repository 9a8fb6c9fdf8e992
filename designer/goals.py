"""What a design can be optimised for: one table, for the requirement, the optimiser, the tables and the reports."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from designer.evaluate.depth import NoiseModel, StereoPair, Volume, depth_error_rms
from designer.optics.backend import Scalar, sqrt
from designer.optics.layout import Layout


class MeasurableBlur(Protocol):
    """The blur of one view somewhere in the working volume."""

    @property
    def in_scene(self) -> Scalar:
        """Its signed diameter as an angle of elevation, radians."""


class MeasurableSystem(Protocol):
    """A system put together, as goals see it; floats, arrays (n,) or CasADi symbols, lengths in mm."""

    @property
    def layout(self) -> Layout:
        """Mirrors, legs of light and solids."""

    @property
    def pair(self) -> StereoPair:
        """The two views."""

    @property
    def volume(self) -> Volume:
        """The working volume."""

    @property
    def noise(self) -> NoiseModel:
        """Standard deviation of an image point in each view, mm on the sensor, wherever it lies."""

    @property
    def scale_uncertainty(self) -> Scalar:
        """Relative standard uncertainty of the image's scale."""

    @property
    def blurs(self) -> tuple[MeasurableBlur, ...]:
        """The blur of both views over the working volume."""

    @property
    def height(self) -> Scalar:
        """Overall height."""

    @property
    def diameter(self) -> Scalar:
        """Overall diameter."""


@dataclass(frozen=True, slots=True)
class TypicalSizes:
    """What a problem's numbers are like: the closed-form limit of the depth error, and the envelope in mm."""

    depth_error: float
    height: float
    diameter: float


@dataclass(frozen=True, slots=True)
class Goal:
    """Something to minimise.

    Attributes
    ----------
    label, description
        What it is in words, alone and in a sentence of the requirement's reference.
    column, unit, column_factor
        The name under which tables and scores hold it, its unit there for people ("%" for a share, which is stored as
        such), and how many of the column's unit one of the optimiser's own is (mm, mm^3, shares).
    expression
        Its value for a system put together, in the optimiser's unit; for floats, arrays and symbols.
    typical_size
        A size near which the solver should see it, in the optimiser's unit.
    multiplier_unit, multiplier_factor
        How a change of it is shown: the unit in words, and how many of it one of the optimiser's own is.
    """

    label: str
    description: str
    column: str
    unit: str
    expression: Callable[[MeasurableSystem], Scalar]
    typical_size: Callable[[TypicalSizes], float]
    column_factor: float = 1.0
    multiplier_unit: str = "mm"
    multiplier_factor: float = 1.0


# Radians; keeps the root's derivative finite where nothing blurs.
_SHARPEST = 1e-6


def fourth_power_mean(values: Sequence[Scalar]) -> Scalar:
    """Fourth root of the mean fourth power: close to the largest of some blurs, and smooth."""
    total = sum(value**4 for value in values) / len(values)
    return sqrt(sqrt(total + _SHARPEST**4))


GOALS: dict[str, Goal] = {
    "depth_error": Goal(
        label="depth error",
        description="root mean square of the relative depth error over the working volume, from noise and scale "
        "together",
        column="depth_error_rms",
        unit="%",
        expression=lambda system: depth_error_rms(system.pair, system.volume, system.noise, system.scale_uncertainty),
        typical_size=lambda sizes: sizes.depth_error if sizes.depth_error > 0.0 else 0.01,
        multiplier_unit="parts per ten thousand (0.01 percentage points of relative depth error)",
        multiplier_factor=1e4,
    ),
    "height": Goal(
        label="height",
        description="of the mirror system",
        column="height_mm",
        unit="mm",
        expression=lambda system: system.height,
        typical_size=lambda sizes: sizes.height,
    ),
    "diameter": Goal(
        label="diameter",
        description="of the mirror system",
        column="diameter_mm",
        unit="mm",
        expression=lambda system: system.diameter,
        typical_size=lambda sizes: sizes.diameter,
    ),
    "volume": Goal(
        label="volume",
        description="of the cylinder that the mirror system spans",
        column="volume_cm3",
        unit="cm³",
        expression=lambda system: (math.pi / 4.0) * system.diameter * system.diameter * system.height,
        typical_size=lambda sizes: (math.pi / 4.0) * sizes.diameter**2 * sizes.height,
        column_factor=1e-3,
        multiplier_unit="cm³",
        multiplier_factor=1e-3,
    ),
    "blur": Goal(
        label="blur",
        description="fourth-power mean of the blur's diameter in the scene, both views, over the working volume",
        column="blur_deg",
        unit="deg",
        expression=lambda system: fourth_power_mean([blur.in_scene for blur in system.blurs]),
        typical_size=lambda sizes: 0.01,
        column_factor=180.0 / math.pi,
        multiplier_unit="degrees",
        multiplier_factor=180.0 / math.pi,
    ),
}
"""Every goal by its name in a requirement."""


def in_columns(values: Mapping[str, float]) -> dict[str, float]:
    """Goals by name, in the optimiser's units, as tables hold them: by column, in the column's unit."""
    return {GOALS[name].column: value * GOALS[name].column_factor for name, value in values.items()}
