"""Some of a requirement's configurations: those that match, and a word about what matches none."""

from __future__ import annotations

import pytest
from click.testing import CliRunner

from designer import api
from designer.cli import cli
from designer.files import InputError
from designer.requirement import Requirement, read_requirement, requirement_to_toml, set_key
from designer.study.run import run_study
from designer.study.selection import restrict
from support.shipped_problems import shipped_requirement

PARABOLOIDS = ("folded-PaPa-Hy-upper_outer", "folded-PaPa-Hy-upper_inner")


@pytest.fixture(scope="module")
def asked() -> Requirement:
    return set_key(shipped_requirement("indoor_robot"), "solve.configurations", ["folded-*", "direct-ElEl-*"])


def test_only_what_matches_and_is_asked_stays(asked):
    assert restrict(asked, ()) is asked
    chosen = restrict(asked, ("*-ElEl-upper_inner", "folded-PaPa-Hy-*"))
    assert set(chosen.solve.configurations) == {"direct-ElEl-upper_inner", *PARABOLOIDS}
    every = restrict(asked, ("*",))
    assert every.configurations == asked.configurations


MISSPELT = (
    "folded-PaPa-Hy-uper_inner",
    "matches none of the 44 configurations; did you mean folded-PaPa-Hy-upper_inner?",
)
LEFT_OUT = (
    "direct-HyHy-*",
    "matches only configurations that the requirement excludes: solve.configurations = ['folded-*', 'direct-ElEl-*']",
)


@pytest.mark.parametrize(("pattern", "advice"), [MISSPELT, LEFT_OUT])
def test_a_name_without_a_configuration_is_refused_in_one_line(pattern, advice, asked, tmp_path):
    line = f"only: {pattern!r} {advice}"
    for study in (
        lambda: api.study(asked, only=(PARABOLOIDS[0], pattern), jobs=1),
        lambda: run_study(asked, tmp_path / "study", only=(PARABOLOIDS[0], pattern)),
    ):
        with pytest.raises(InputError) as refusal:
            study()
        assert str(refusal.value) == line
    (tmp_path / "my.toml").write_text(requirement_to_toml(asked), encoding="utf-8")
    words = ["study", str(tmp_path / "my.toml"), "--out", str(tmp_path / "study"), "--only", PARABOLOIDS[0], pattern]
    outcome = CliRunner().invoke(cli, words)
    assert (outcome.exit_code, outcome.output) == (2, f"designer: --{line}\n")
    assert not (tmp_path / "study").exists()


def test_the_folder_says_which_configurations_were_studied(asked, tmp_path):
    study = run_study(asked, tmp_path, only=("direct-ElEl-*",))
    names = [row.configuration for row in study.rows]
    assert names == ["direct-ElEl-upper_outer", "direct-ElEl-upper_inner"]
    assert read_requirement(tmp_path / "requirement.toml") == study.requirement
    assert list(study.requirement.solve.configurations) == names
