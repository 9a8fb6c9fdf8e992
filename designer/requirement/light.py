"""The light that images are taken in, and the texture that is matched: what a predicted noise is made of."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from designer.requirement.part import Part
from designer.requirement.quantity import Quantity


class Light(Part):
    """The light that a pixel collects: exposure time and illumination, combined in one number of electrons."""

    white_electrons: Annotated[
        float,
        Quantity(10, 1e7, "electrons"),
        Field(
            title="electrons from white",
            default=10_000.0,
            description="Electrons per pixel from a white surface at at_f_number, for the exposure time and the "
            "illumination in use. The number varies with the f-number N as 1 / N^2. "
            "Default: 10000, a well-exposed small sensor.",
        ),
    ]
    at_f_number: Annotated[
        float,
        Quantity(0.5, 128),
        Field(
            title="at f-number",
            default=5.6,
            description="F-number at which white_electrons is given. Default: 5.6.",
        ),
    ]
    read_noise_electrons: Annotated[
        float,
        Quantity(0, 10_000, "electrons"),
        Field(
            title="read noise",
            default=8.0,
            description="Standard deviation of the detector's noise in the dark. Default: 8.",
        ),
    ]
    wavelength_nm: Annotated[
        float,
        Quantity(200, 20_000, "nm"),
        Field(
            title="wavelength",
            default=550.0,
            description="Wavelength, for diffraction. Default: 550, green.",
        ),
    ]
    mirror_reflectivity: Annotated[
        float,
        Quantity(0.01, 1),
        Field(
            title="mirror reflectivity",
            default=0.88,
            description="Share of the light that a mirror reflects. Default: 0.88, bare aluminium in the visible.",
        ),
    ]


class Matching(Part):
    """The texture for block matching: with the lens and the light it determines the predicted noise."""

    texture_contrast: Annotated[
        float,
        Quantity(1e-4, 1),
        Field(
            title="contrast of each octave",
            default=0.106,
            description="Root-mean-square contrast of each octave of the surfaces' texture, relative to their tone. "
            "Default: 0.106, well-textured surfaces; printed posters have 0.2, painted walls 0.005.",
        ),
    ]
