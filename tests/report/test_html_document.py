"""study.html as a file: whole, safe whatever a title says, the same twice, and without a reference to anything else."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from sample_study import NASTY_TITLE, crowd, prototype, two_direct_mirrors, write_sample_study

from designer.evaluate.fabrication import mirror_shape
from designer.evaluate.score import evaluate_design
from designer.files import InputError
from designer.report.html import document
from designer.report.html.document import MODULES, embedded_json, joined_script, page_of, write_design_html, write_html
from designer.report.html.payload import payload_of_design, payload_of_study
from designer.study.folder import read_study, write_study
from designer.study.manifest import read_manifest

SOURCES = Path(document.__file__).parent
ESCAPING = '</script><script>alert(1)</script><!-- <img src=x onerror=alert(1)> & "quoted" \u2028 \u2029 {{script}}'
TOP_LEVEL = re.compile(r"^(?:export )?(?:async )?(?:const|let|function|class) (\w+|\[[^\]]*\]|\{[^}]*\})", re.MULTILINE)
IMPORT = re.compile(r"^import\s*\{([^}]*)\}\s*from\s*\"\./(\w+)\.mjs\";$", re.MULTILINE)


class Reader(HTMLParser):
    """What a browser's parser finds: the text of each script and of the title, and every address."""

    def __init__(self) -> None:
        super().__init__()
        self.scripts: dict[str, str] = {}
        self.title = ""
        self.addresses: list[str] = []
        self.tags: list[str] = []
        self._inside = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.tags.append(tag)
        self.addresses += [str(given[name]) for name in ("src", "href", "action", "data") if name in given]
        self._inside = (given.get("id") or given.get("type") or "") if tag == "script" else tag
        if tag == "script":
            assert self._inside not in self.scripts
            self.scripts[self._inside] = ""

    def handle_endtag(self, tag: str) -> None:
        self._inside = ""

    def handle_data(self, data: str) -> None:
        if self._inside in self.scripts:
            self.scripts[self._inside] += data
        elif self._inside == "title":
            self.title += data


def read(page: str) -> tuple[Reader, dict[str, Any]]:
    reader = Reader()
    reader.feed(page)
    reader.close()
    assert set(reader.scripts) == {"payload", "three", "module"}
    return reader, json.loads(reader.scripts["payload"])


@pytest.mark.parametrize("title", [ESCAPING, NASTY_TITLE])
def test_no_title_or_reason_breaks_out_of_its_place(title: str, tmp_path: Path) -> None:
    study = read_study(write_sample_study(tmp_path / "study", title="plain", designs=(prototype(),)))
    requirement = study.requirement.model_copy(update={"title": title, "description": title})
    rows = tuple(row.with_values(reason=title) if row.reason else row for row in study.rows)
    page = page_of(payload_of_study(replace(study, requirement=requirement, rows=rows)))
    reader, payload = read(page)
    assert reader.title == title
    assert payload["title"] == title
    assert {row["reason"] for row in payload["rows"] if "reason" in row} == {title}
    assert reader.tags.count("script") == 3
    assert "img" not in reader.tags
    inside = page.partition('id="payload">')[2].partition("</script>")[0]
    assert not set("<>&\u2028\u2029") & set(inside)


def test_half_of_a_surrogate_pair_can_be_written() -> None:
    text = embedded_json({"title": "\ud83d broken \U0001f600"})
    assert json.loads(text.encode("utf-8")) == {"title": "\ud83d broken \U0001f600"}


def test_the_page_stands_alone(tmp_path: Path) -> None:
    folder = write_sample_study(tmp_path / "study")
    reader, _ = read(write_html(read_study(folder), folder).read_text(encoding="utf-8"))
    assert {address for address in reader.addresses if not address.startswith("#")} == set()
    assert not {"link", "iframe", "object", "embed", "base"} & set(reader.tags)
    style = (SOURCES / "style.css").read_text(encoding="utf-8")
    assert "url(" not in style
    assert "@import" not in style
    policy = re.search(r'Content-Security-Policy"\s+content="([^"]*)"', page_of(payload_of_study(read_study(folder))))
    assert policy is not None
    assert "default-src 'none'" in policy[1]
    assert "http" not in policy[1]
    assert "connect-src" not in policy[1]


def test_it_is_one_of_the_studys_own_files(tmp_path: Path) -> None:
    folder = tmp_path / "study"
    study = read_study(write_sample_study(tmp_path / "sample", designs=(prototype(),)))
    write_study(study, folder)
    page = write_html(study, folder)
    assert page == folder / "study.html"
    assert "study.html" in (read_manifest(folder) or {})
    page.write_text("mine", encoding="utf-8")
    with pytest.raises(InputError, match=r"study\.html: not written by the study, or changed since"):
        write_html(study, folder)
    assert page.read_text(encoding="utf-8") == "mine"


def test_the_same_study_gives_the_same_bytes(tmp_path: Path) -> None:
    study = read_study(write_sample_study(tmp_path / "sample"))
    write_study(study, tmp_path / "copy")
    pages = {page_of(payload_of_study(each)) for each in (study, study, read_study(tmp_path / "copy"))}
    assert len(pages) == 1


def test_what_the_page_knows_is_what_the_study_found(tmp_path: Path) -> None:
    designs = (prototype(), two_direct_mirrors())
    study = read_study(write_sample_study(tmp_path / "sample", designs=designs))
    payload: Any = payload_of_study(study)
    assert [row["configuration"] for row in payload["rows"]] == [row.configuration for row in study.rows]
    assert list(payload["designs"]) == [design.configuration for design in designs]
    for design in designs:
        shown = payload["designs"][design.configuration]
        assert [mirror["vertex_mm"] for mirror in shown["mirrors"]] == [m.vertex_mm for m in design.mirrors]
        mass = sum(mirror_shape(design, mirror.name).mass_g for mirror in design.mirrors)
        row = next(row for row in payload["rows"] if row["configuration"] == design.configuration)
        assert row["mass_g"] == pytest.approx(mass, rel=1e-9)
    assert {point["swept"] for point in payload["fronts"]} <= {"height_mm", "diameter_mm"}
    assert len(payload["fronts"]) == len(study.pareto)


def test_many_designs_stay_far_below_4_mb(tmp_path: Path) -> None:
    folder = write_sample_study(tmp_path / "crowd", designs=crowd(44))
    assert write_html(read_study(folder), folder).stat().st_size < 2_000_000


def test_a_single_design_has_a_page_with_its_own_score(tmp_path: Path) -> None:
    design = two_direct_mirrors()
    write_design_html(design, tmp_path / "one.html")
    _, payload = read((tmp_path / "one.html").read_text(encoding="utf-8"))
    assert payload == json.loads(json.dumps(payload_of_design(design)))
    (row,) = payload["rows"]
    assert row["depth_error_rms"] == pytest.approx(evaluate_design(design).depth.depth_error_rms, rel=1e-9)
    absurd = design.model_copy(update={"baseline_mm": -1.0})
    with pytest.raises(InputError, match="baseline_mm"):
        write_design_html(absurd, tmp_path / "absurd.html")


def test_the_scripts_make_one_module() -> None:
    """Each is joined once, below what it imports; names that only one of them may have are there once."""
    assert {path.stem for path in (SOURCES / "js").glob("*.mjs")} == set(MODULES)
    texts = {name: (SOURCES / "js" / f"{name}.mjs").read_text(encoding="utf-8") for name in MODULES}
    names = [found for text in texts.values() for found in TOP_LEVEL.findall(text)]
    assert sorted(names) == sorted(set(names))
    for place, (name, text) in enumerate(texts.items()):
        for imported, source in IMPORT.findall(text):
            assert source in MODULES[:place], f"{name} imports {source}, which must come before it"
            for each in filter(None, map(str.strip, imported.split(","))):
                assert re.search(rf"^export (?:const|function) {each}\b", texts[source], re.MULTILINE), (name, each)
                assert len(re.findall(rf"\b{each}\b", text)) > 1, f"{name} imports {each} and does not use it"
    joined = joined_script()
    assert not re.search(r"^\s*(import|export)\b", joined, re.MULTILINE)
    assert "</script" not in joined
