"""What the judge says of a design: the verdict, of each view and of the whole."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from designer.design import Interval, ViewName
from designer.notebook_html import html_table, percent
from designer.verify.coverage import ImageZone
from designer.verify.light import ViewLight


@dataclass(frozen=True, slots=True)
class Blockage:
    """Elevations that the mirrors' apertures let through, but something in the way hides.

    ``leg`` says where ("primary to world"), ``element`` what stands there; ``is_asked`` whether it takes away a part
    of the elevations asked of the view.
    """

    leg: str
    element: str
    elevation_deg: Interval
    is_asked: bool


@dataclass(frozen=True, slots=True)
class ViewVerdict:
    """What tracing says of one view.

    ``viewpoint_mm`` is the recorded one, or where the exit rays cross the axis if that is elsewhere.
    ``asked_elevation_deg`` is what is recorded for the view, and what else the working volume needs;
    ``aperture_elevation_deg`` what the mirrors' apertures let through to the whole image, blockage ignored (None:
    nothing); ``seen_elevation_deg`` the ranges seen inside the image circle, each mirror of the path met first;
    ``gaps_deg`` the parts of the asked range that are not seen; ``zone_psi_deg`` the angles at the pinhole that the
    asked range takes, None if part of it is not in the image. Residuals are the largest over the rays that the
    apertures let through: distance of an exit line from the viewpoint, and |tan(psi/2) - gain tan(pi/4 +- phi/2)|
    with phi measured from the exit ray; infinite if there is no such ray. ``clearance_mm`` is the least distance, in
    the meridional plane, of a leg of the asked rays from a rim other than those beside which it starts or ends.
    """

    path: tuple[str, ...]
    viewpoint_mm: float
    asked_elevation_deg: Interval
    aperture_elevation_deg: Interval | None
    seen_elevation_deg: tuple[Interval, ...]
    gaps_deg: tuple[Interval, ...]
    zone_psi_deg: Interval | None
    svp_residual_mm: float
    gain_residual: float
    blockages: tuple[Blockage, ...]
    clearance_mm: float
    clearance_at: str
    problems: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Verdict:
    """The tracer's verdict on a design; ``problems`` says in one sentence each why it did not pass.

    ``image`` says what the camera sees from the image centre out to the corner, in rising pinhole angles; ``light``
    what becomes of the full pupil's light, by view.
    """

    passed: bool
    problems: tuple[str, ...]
    configuration: str
    baseline_mm: float
    upper: ViewVerdict
    lower: ViewVerdict
    image: tuple[ImageZone, ...]
    light: Mapping[ViewName, ViewLight]

    @property
    def views(self) -> dict[ViewName, ViewVerdict]:
        """Both views by name."""
        return {"upper": self.upper, "lower": self.lower}

    @property
    def smallest_clearance_mm(self) -> float:
        """The lesser clearance of the two views."""
        return min(self.upper.clearance_mm, self.lower.clearance_mm)

    def _repr_html_(self) -> str:
        title = f"{self.configuration}: {'passes' if self.passed else 'does not pass'}"
        columns = (
            "view",
            "viewpoint (mm)",
            "single-viewpoint residual (mm)",
            "least clearance (mm)",
            "least light",
            "largest blur (px)",
            "problems",
        )
        rows = [
            (
                name,
                view.viewpoint_mm,
                view.svp_residual_mm,
                view.clearance_mm,
                percent(self.light[name].least_arriving),
                self.light[name].largest_blur_px,
                len(view.problems),
            )
            for name, view in self.views.items()
        ]
        return html_table(title, columns, rows, "; ".join(self.problems))
