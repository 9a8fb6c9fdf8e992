"""Names for the arrays that rays are held in."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Rows = Sequence[Array] | Array
"""Coordinates of points or vectors, (x, y, z) or (r, z): an array (3 or 2, n), or its rows."""
