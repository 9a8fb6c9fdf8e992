"""What the command line asked of the stand-ins for study and report."""

from dataclasses import dataclass, field
from pathlib import Path

from designer.requirement import Requirement
from designer.study.study import LensRow


@dataclass
class Calls:
    """The arguments of every call, in order, the tables of the study, and the notes on its best design."""

    designs: str
    requirements: list[Requirement] = field(default_factory=list)
    folders: list[Path] = field(default_factory=list)
    jobs: list[int] = field(default_factory=list)
    only: list[tuple[str, ...]] = field(default_factory=list)
    checks: list[list[str]] = field(default_factory=list)
    reports: list[Path] = field(default_factory=list)
    pages: list[Path] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    lenses: tuple[LensRow, ...] = ()
