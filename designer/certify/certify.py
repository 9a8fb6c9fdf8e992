"""Certify a study: prove what can be proved about each of its configurations, and keep it in its folder.

``certificates.csv`` and ``certificates.json`` in the folder hold a certificate for each configuration looked at. They
are written anew after each, so that what is proved stays when the rest is interrupted.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Sequence
from dataclasses import fields, replace
from fnmatch import fnmatchcase
from importlib.metadata import version
from pathlib import Path

import pandas as pd

from designer import __version__
from designer.certify.certificate import UNKNOWN_RULES, Certificate
from designer.certify.prove import bound_of, prove_infeasible
from designer.configurations import Configuration
from designer.files import InputError, as_json, read_text, write_atomically
from designer.requirement import Requirement
from designer.study.claim import locked_study
from designer.study.folder import read_rows, read_stored_requirement
from designer.study.manifest import announce, settle
from designer.study.names import CERTIFICATES, CERTIFICATES_TABLE, RESULTS
from designer.study.row import Row

Listener = Callable[[int, int, Certificate], None]
"""Called with how many are done, of how many, and the last."""

ROUNDING = "intervals and affine forms, rounded outwards: no bound depends on rounding"
"""How far the numbers of a proof can be relied on."""


def certify_study(
    folder: Path, seconds: float, only: Collection[str] = (), progress: Listener | None = None
) -> list[Certificate]:
    """Certify the configurations of a study that are feasible or were found infeasible.

    Parameters
    ----------
    folder
        The results folder of a study.
    seconds
        Processor time for each configuration.
    only
        Names or glob patterns of configurations; all if there are none.

    Raises
    ------
    InputError
        The folder is no study's, or a pattern matches none of its configurations.
    """
    if not (folder / RESULTS).is_file():
        raise InputError(f"{folder}: not the folder of a study: it does not contain {RESULTS}")
    with locked_study(folder):
        requirement, rows = read_stored_requirement(folder), read_rows(folder)
        chosen = _chosen(rows, only)
        by_name = {configuration.name: configuration for configuration in requirement.configurations}
        known = {} if not only else {each.configuration: each for each in read_certificates(folder)}
        found = []
        for done, row in enumerate(chosen, start=1):
            certificate = certify_row(requirement, by_name[row.configuration], row, seconds)
            found.append(certificate)
            known[certificate.configuration] = certificate
            _write(folder, [known[each.configuration] for each in rows if each.configuration in known])
            if progress is not None:
                progress(done, len(chosen), certificate)
    return found


def certify_row(requirement: Requirement, configuration: Configuration, row: Row, seconds: float) -> Certificate:
    """Prove what can be proved about a row of a study's table, in a processor time."""
    if row.status != "feasible":
        return prove_infeasible(requirement, configuration, seconds)
    design, found = row.number("depth_error_rms"), row.number("first_stage_depth_error_rms")
    found = found if found is not None else design
    if found is None:
        raise InputError(f"{row.configuration}: the study's table has no depth error of its design")
    return bound_of(requirement, configuration, found, design, seconds)


def read_certificates(folder: Path) -> list[Certificate]:
    """The certificates that stand in a study's folder; none if there are none.

    Raises
    ------
    InputError
        The file cannot be understood.
    """
    path = folder / CERTIFICATES
    if not path.is_file():
        return []
    try:
        entries = json.loads(read_text(path))["certificates"]
        names = {field.name for field in fields(Certificate)}
        read = [Certificate(**{name: value for name, value in entry.items() if name in names}) for entry in entries]
    except (ValueError, TypeError, KeyError, AttributeError):
        raise InputError(f"{path}: not certificates that the designer wrote") from None
    return [replace(each, conflicting_keys=tuple(each.conflicting_keys)) for each in read]


def certificate_frame(certificates: Sequence[Certificate]) -> pd.DataFrame:
    """Certificates as a table, a row for each."""
    records = [each.as_json() | {"conflicting_keys": " ".join(each.conflicting_keys)} for each in certificates]
    return pd.DataFrame(records, columns=[field.name for field in fields(Certificate)])


def _chosen(rows: Sequence[Row], only: Collection[str]) -> list[Row]:
    """The rows to certify: what a rule excludes is proved by that rule."""
    for pattern in only:
        if not any(fnmatchcase(row.configuration, pattern) for row in rows):
            raise InputError(f"--only {pattern}: matches no configuration of this study")
    named = [row for row in rows if not only or any(fnmatchcase(row.configuration, pattern) for pattern in only)]
    return [row for row in named if row.status != "impossible"]


def _write(folder: Path, certificates: Sequence[Certificate]) -> None:
    content = {
        "designer": __version__,
        "numba": version("numba"),
        "numpy": version("numpy"),
        "rounding": ROUNDING,
        "not_known_to_bounds": UNKNOWN_RULES,
        "certificates": as_json([each.as_json() for each in certificates]),
    }
    files = {
        CERTIFICATES: json.dumps(content, indent=2) + "\n",
        CERTIFICATES_TABLE: certificate_frame(certificates).to_csv(index=False),
    }
    announce(folder, files)
    for name, text in files.items():
        write_atomically(folder / name, text)
    settle(folder, files)
