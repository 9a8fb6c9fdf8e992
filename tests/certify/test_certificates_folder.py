"""Certificates in a study's folder: written one by one, kept by name, refused where others have edited them."""

from __future__ import annotations

import csv
import json

import pytest
from click.testing import CliRunner

from designer import api
from designer.certify.certify import certify_study, read_certificates
from designer.cli import cli
from designer.files import InputError
from designer.requirement import requirement_to_toml
from support.proved import requirement_of

TABLE = """\
configuration,family,topology,status,reason,depth_error_rms,limit_ratio,first_stage_depth_error_rms
folded-ElHy-Hy-upper_outer,folded,upper_outer,feasible,,0.00071,1.02,0.000703
folded-ElHy-El-upper_inner,folded,upper_inner,feasible,,0.00071,1.02,0.000703
folded-PlHy-Hy-upper_outer,folded,upper_outer,infeasible,height exceeded by 0.6 mm,,,
folded-PlPl-Hy-upper_outer,folded,upper_outer,impossible,a rule,,,
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "requirement.toml").write_text(requirement_to_toml(requirement_of("pipe_inspection")), "utf-8")
    (tmp_path / "designs.csv").write_text(TABLE, "utf-8")
    return tmp_path


def table(folder):
    with (folder / "certificates.csv").open(encoding="utf-8") as lines:
        return {row["configuration"]: row for row in csv.DictReader(lines)}


def test_certificates_are_kept_by_name_and_written_one_by_one(folder):
    seen = []

    def stop_at_second(done, total, certificate):
        seen.append((done, total, certificate.configuration))
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        certify_study(folder, 1.0, progress=stop_at_second)
    assert [place[:2] for place in seen] == [(1, 3), (2, 3)]
    rows = table(folder)
    assert set(rows) == {"folded-ElHy-Hy-upper_outer", "folded-ElHy-El-upper_inner"}
    first = rows["folded-ElHy-Hy-upper_outer"]
    assert first["status"] == "optimal"
    assert float(first["depth_error_bound"]) == pytest.approx(0.000703 / 1.01)
    assert float(first["gap_percent"]) == pytest.approx(1.0)
    assert float(first["design_gap_percent"]) == pytest.approx(100.0 * (0.00071 * 1.01 / 0.000703 - 1.0))

    frame = api.certify(folder, ["*-Pl*"], 1.0)
    assert list(frame["status"]) == ["not proven"]
    # What a rule excludes is not looked at; what was proved before stays.
    assert set(table(folder)) == set(rows) | {"folded-PlHy-Hy-upper_outer"}
    assert [each.configuration for each in read_certificates(folder)] == list(table(folder))
    listed = json.loads((folder / "manifest.json").read_text("utf-8"))["files"]
    assert {"certificates.csv", "certificates.json"} <= set(listed)

    (folder / "certificates.csv").write_text("mine\n", "utf-8")
    with pytest.raises(InputError, match=r"certificates.csv: not written by the study, or changed since"):
        certify_study(folder, 1.0, ["*-ElHy-Hy-*"])


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere"], "nowhere: must be the folder of a study"),
        (["."], ".: not the folder of a study: it does not contain designs.csv"),
        (["STUDY", "--only", "x*"], "--only x*: matches no configuration of this study"),
    ],
)
def test_what_cannot_be_certified_is_said_in_one_line(folder, tmp_path_factory, monkeypatch, arguments, said):
    monkeypatch.chdir(tmp_path_factory.mktemp("empty"))
    ended = CliRunner().invoke(cli, ["certify", *(str(folder) if each == "STUDY" else each for each in arguments)])
    assert ended.exit_code == 2
    assert said in ended.output
    assert len(ended.output.strip().splitlines()) == 1


def test_command_tells_bound_and_rules(folder):
    ended = CliRunner().invoke(cli, ["certify", str(folder), "--only", "folded-ElHy-Hy-*", "--seconds", "1"])
    assert ended.exit_code == 0, ended.output
    assert "optimal within 1 %" in ended.output
    assert "0.0696" in ended.output
    assert "not known: other clearances" in ended.output
