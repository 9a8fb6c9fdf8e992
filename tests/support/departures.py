"""Departures of built sensors."""

import numpy as np

from designer.as_built.parameters import parameters_of
from designer.design import Design

STEPS = {"mm": 0.1, "deg": 0.1, "1/m": 0.05, "": 0.005}


def random_departures(design: Design, seed: int, count: int = 1) -> np.ndarray:
    """Departures (count, parameters) of ordinary size."""
    scale = np.array([STEPS[parameter.unit] for parameter in parameters_of(design)])
    return scale * np.random.default_rng(seed).standard_normal((count, len(scale)))
