"""A row of results: what a study or a sweep says of one configuration."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from designer.study.columns import COLUMNS, NAMES_OF_VERSION_0_1, Column, Found, Value, typed

if TYPE_CHECKING:  # processes that solve need no tables
    import pandas as pd


@dataclass(frozen=True, slots=True)
class Row:
    """One configuration's row: the values of :data:`designer.study.columns.COLUMNS` that are known, by name."""

    values: Mapping[str, Value]

    @property
    def configuration(self) -> str:
        """Name of the configuration."""
        return self.text("configuration")

    @property
    def family(self) -> str:
        """Its family, direct or folded."""
        return self.text("family")

    @property
    def status(self) -> str:
        """Its status: feasible, infeasible, failed or impossible."""
        return self.text("status")

    @property
    def reason(self) -> str:
        """Why it is not feasible; empty if it is."""
        return self.text("reason")

    @property
    def rank(self) -> int | None:
        """Place in the ranking, from 1; None unless feasible."""
        value = self.number("rank")
        return None if value is None else int(value)

    def number(self, column: str) -> float | None:
        """A column's number, or None."""
        value = self.values.get(_known(column))
        return None if value is None or isinstance(value, str) else value

    def text(self, column: str) -> str:
        """A column's text; empty if there is none."""
        return str(self.values.get(_known(column)) or "")

    @property
    def is_beyond_first_order(self) -> bool:
        """Whether first order is off at the worst point of the volume; False where the table does not say."""
        return self.values.get("first_order_valid") is False

    @property
    def is_beyond_second_order(self) -> bool:
        """Whether second order is off too, so that only a Monte Carlo is honest."""
        return self.values.get("second_order_valid") is False

    @property
    def least_limit(self) -> float | None:
        """The least limit over all allowed baselines and focal lengths; None unless it is below the design's own."""
        least, error, ratio = (
            self.number(key) for key in ("least_limit_depth_error_rms", "depth_error_rms", "limit_ratio")
        )
        if least is None or error is None or ratio is None:
            return None
        return least if least * ratio < 0.9999 * error else None

    def with_values(self, **values: Value) -> Row:
        """The row with some values set."""
        return Row({**self.values, **{_known(name): value for name, value in values.items()}})


def row_of(found: Found, columns: Mapping[str, Column] = COLUMNS) -> Row:
    """The row of what was found."""
    values = {name: column.value(found) for name, column in columns.items()}
    return Row({name: value for name, value in values.items() if value is not None and value != ""})


def read_row(texts: Mapping[str, str]) -> Row:
    """A row from the texts of its cells; unknown columns, and numbers that are none or not finite, are left out."""
    named = {NAMES_OF_VERSION_0_1.get(name, name): text for name, text in texts.items()}
    values = {name: _PARSERS[COLUMNS[name].kind](text) for name, text in named.items() if name in COLUMNS and text}
    return Row({name: value for name, value in values.items() if value is not None})


def frame_of(rows: Iterable[Row], columns: Mapping[str, Column] = COLUMNS) -> pd.DataFrame:
    """The rows as a table, with every column whether or not any row has it."""
    import pandas as pd

    return typed(pd.DataFrame([row.values for row in rows], columns=list(columns)))


def _known(column: str) -> str:
    if column not in COLUMNS:
        raise KeyError(f"no results column is called {column}")
    return column


def number_in(text: str) -> float | None:
    """The finite number that a cell holds; None if it holds none."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _whole_number(text: str) -> int | None:
    value = number_in(text)
    return None if value is None else int(value)


def _truth(text: str) -> bool | None:
    return {"True": True, "False": False}.get(text)


_PARSERS: dict[type, Callable[[str], Value]] = {str: str, float: number_in, int: _whole_number, bool: _truth}
