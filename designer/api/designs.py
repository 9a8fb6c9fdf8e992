"""One design: its file, its export, its score, the tracer's verdict on it, and rays through it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from designer.extras import is_installed
from designer.files import InputError
from designer.notebook_html import html_table, percent

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from designer.design import Design
    from designer.evaluate.focus_table import FocusTable
    from designer.evaluate.score import Score
    from designer.export.order.package import Order
    from designer.trace.sequential import SequentialTrace
    from designer.verify.verdict import Verdict

# A length off by so much moves the points of a ray by less than a nanometre.
UNIT_WITHIN = 1e-9


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Evaluation:
    """The score of a design and its notes.

    Attributes
    ----------
    design
        The design as its mirrors make it: that is what is scored.
    contradictions
        A sentence for each recorded number that the mirrors contradict.
    score
        The score; ``score.as_json()`` is what ``designer evaluate --json`` prints under ``evaluation``.
    focus
        How sharp the design is through its lens: what ``designer evaluate --json`` prints under ``focus``; None where
        its numbers do not say.
    """

    design: Design
    contradictions: tuple[str, ...]
    score: Score
    focus: FocusTable | None

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences to read before ordering mirrors."""
        return self.score.fabrication_notes

    @property
    def depth_error_rms(self) -> float | None:
        """sigma_D / D, rms over the working volume, to first order; None if infinite."""
        return self.score.depth.depth_error_rms

    @property
    def depth_error_worst(self) -> float | None:
        """The largest sigma_D / D in the working volume, to first order; None if infinite."""
        return self.score.depth.depth_error_worst

    @property
    def limit_ratio(self) -> float | None:
        """The depth error over the closed-form limit; None where there is no limit."""
        return self.score.depth.limit_ratio

    @property
    def depth_shift_per_scale(self) -> float | None:
        """(dD / D) / epsilon, rms over the working volume, for a relative error epsilon of the image's scale."""
        return self.score.depth.depth_shift_per_scale

    def _repr_html_(self) -> str:
        rows = [
            ("depth error, rms", percent(self.depth_error_rms)),
            ("depth error, largest", percent(self.depth_error_worst)),
            ("depth shift per error of the image's scale, rms", self.depth_shift_per_scale),
            ("ratio to the limit", self.limit_ratio),
            ("baseline (mm)", self.design.baseline_mm),
            ("height (mm)", self.score.height_mm),
            ("diameter (mm)", self.score.diameter_mm),
            *(() if self.focus is None else (("largest blur through the lens (px)", self.focus["largest_blur_px"]),)),
            *(("contradicted", sentence) for sentence in self.contradictions),
            *(("before ordering mirrors", sentence) for sentence in self.notes),
        ]
        return html_table(self.design.configuration, ("", ""), rows)


def read_design(path: str | Path) -> Design:
    """A design from its file (``designs/*.json``).

    Raises
    ------
    InputError
        The file cannot be read or is no design.
    """
    from designer.design import read_design as read

    return read(Path(path))


def write_design(path: str | Path, design: Design) -> None:
    """Write a design's file."""
    from designer.design import write_design as write

    write(design, Path(path))


def export(design: Design, to: str, path: str | Path, *, tolerances: str | Path | None = None) -> tuple[Path, ...]:
    """Write a design in a format of another program, lengths in mm, and return the files written.

    Parameters
    ----------
    to
        Name of the format, such as ``zmx``: docs/api.md says what each holds.
    path
        A file for a format that holds the whole design in one (``povray``, ``dxf``), else a folder.
    tolerances
        For drawing sheets: a grade (``coarse``, ``standard``, ``precision``), or a TOML file of tolerances.

    Raises
    ------
    InputError
        There is no such format, it cannot hold the design or the tolerances, or the path does not fit it.
    """
    from designer.as_built.named import named_tolerances
    from designer.export.formats import export_design

    held = None if tolerances is None else named_tolerances(str(tolerances), design)
    return export_design(design, to, Path(path), held)


def order(design: Design, folder: str | Path, *, tolerances: str | Path | None = None) -> Order:
    """Write all that a workshop needs of a design into one folder, as ``designer order`` does.

    ``tolerances`` are as for :func:`export`.

    Returns
    -------
    Order
        ``folder``, ``files``, ``left_out`` (a reason for each format that is not there) and ``problems`` (why the ray
        tracer rejects the design; empty if it accepts it).

    Raises
    ------
    InputError
        The folder holds something else, or the design cannot be drawn.
    """
    from designer.as_built.named import named_tolerances
    from designer.export.order.package import write_order

    held = None if tolerances is None else named_tolerances(str(tolerances), design)
    return write_order(design, Path(folder), held)


def evaluate(design: Design) -> Evaluation:
    """Score a design, also one typed in by hand; where its record contradicts its mirrors, the mirrors count.

    Raises
    ------
    InputError
        The design cannot be scored: its numbers describe no stereo pair.
    """
    from designer.evaluate.focus_table import focus_table
    from designer.evaluate.score import evaluate_design
    from designer.verify.contradicted_record import record_problems
    from designer.verify.traced_views import as_traced

    as_made, said = as_traced(design)
    contradictions = (*said, *record_problems(as_made))
    return Evaluation(as_made, contradictions, evaluate_design(as_made), focus_table(as_made))


def trace(design: Design) -> Verdict:
    """The tracer's verdict on a design."""
    from designer.verify.judge import judge

    return judge(design)


def trace_rays(design: Design, view: Literal["upper", "lower"], directions: ArrayLike) -> SequentialTrace:
    """Rays of one's own from the pinhole through the mirrors of a view: the points on each, and the exit directions.

    Nothing blocks them but the mirrors' own apertures, and no tube refracts them: `designer.trace.housing` follows
    them out of a housing. With the extra ``compiled``, loops that are compiled at the
    first call trace them, some forty million a second; without it NumPy does, half as fast. Through the mirrors of a
    sensor as it was built (``as_built``) NumPy traces them, and all stays in the frame of its camera.

    Parameters
    ----------
    directions
        Unit vectors (n, 3), frame of the pinhole.

    Raises
    ------
    InputError
        There is no such view, or these are not unit vectors.
    """
    import numpy as np

    from designer.trace.built import build_as_built
    from designer.trace.instrument import build_instrument
    from designer.trace.sequential import trace_sequential

    if view not in {"upper", "lower"}:
        raise InputError(f"view = {view!r}: must be upper or lower")
    directions = np.asarray(directions, dtype=float)
    if directions.ndim != 2 or directions.shape[1] != 3:
        raise InputError(f"directions: must have shape (n, 3), not {directions.shape}")
    if not np.allclose(np.linalg.norm(directions, axis=1), 1.0, rtol=0.0, atol=UNIT_WITHIN):
        raise InputError("directions: must be unit vectors")
    instrument = build_instrument(design) if design.as_built is None else build_as_built(design).instrument
    path = instrument.path(design.views.by_name[view].path)
    if design.as_built is not None or not is_installed("compiled"):
        return trace_sequential(instrument, path, directions)
    from designer.trace.compiled import trace_many

    return trace_many(instrument, path, directions)
