"""Options that ``designer check`` and ``designer render`` share: the scene, its texture, and the detector."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from designer.files import InputError

if TYPE_CHECKING:
    from designer.imaging.render.detector import Detector

Command = Callable[..., Any]

design_argument = click.argument("design", type=click.Path(path_type=Path), metavar="DESIGN.json")

scene_option = click.option(
    "--scene",
    default="auto",
    show_default=True,
    help="office, pipe, hall, sky or cylinder, auto (chosen from the working volume), or a mesh file (mm, z up).",
)
texture_option = click.option(
    "--texture", default="rich", show_default=True, help="rich, poor, repetitive or natural (each surface's own)."
)


def lens_option(help_text: str) -> Callable[[Command], Command]:
    """``--lens``, or ``--aperture``, the first name that it had."""
    return click.option("--lens", "--aperture", "through_lens", is_flag=True, help=help_text)


seed_option = click.option(
    "--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Random seed of textures and noise."
)


def detector_options(read_noise_electrons: float | None) -> Callable[[Command], Command]:
    """``--noise-electrons``, with a default or none (no noise at all), and ``--full-well-electrons``."""
    noise = click.option(
        "--noise-electrons",
        type=float,
        default=read_noise_electrons,
        show_default=read_noise_electrons is not None,
        help="Read noise of the detector; shot noise is added to it."
        + ("" if read_noise_electrons is not None else "  [default: no noise]"),
    )
    full_well = click.option(
        "--full-well-electrons",
        type=float,
        default=10_000.0,
        show_default=True,
        help="Full-well capacity, reached at white.",
    )
    return lambda command: noise(full_well(command))


def check_electrons(noise_electrons: float | None, full_well_electrons: float) -> None:
    """Raise InputError for a detector that cannot exist."""
    if noise_electrons is not None and not 0.0 <= noise_electrons < float("inf"):
        raise InputError(f"--noise-electrons {noise_electrons:g}: must be at least 0")
    if not 1.0 <= full_well_electrons < float("inf"):
        raise InputError(f"--full-well-electrons {full_well_electrons:g}: must be at least 1")


def detector_of(noise_electrons: float, full_well_electrons: float) -> Detector:
    """The detector that the options describe."""
    from designer.imaging.render.detector import Detector

    return Detector(full_well_electrons, noise_electrons)
