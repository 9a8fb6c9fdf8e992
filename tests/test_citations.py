"""Documentation that code and pages cite exists: every page, and every section named of it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PLACES = ("designer", "tests", "benchmarks", "notebooks", "docs", "README.md")
ENDINGS = {".py", ".md", ".toml", ".ipynb", ".typ"}
# "docs/theory.md, sections 2 to 4"; a sentence may break over a line, inside a comment too.
PAGE = re.compile(r"docs/[\w/.-]*\w")
SECTIONS = re.compile(r"(docs/[\w/-]+\.md),[\s#]+sections?[\s#]+(\d+)(?:[\s#]+(?:to|and)[\s#]+(\d+))?")
HEADING = re.compile(r"^## (\d+)\. (.+)$", re.MULTILINE)
LINK = re.compile(r"\]\(([\w./-]*)#([\w-]+)\)")


def files() -> Iterator[tuple[Path, str]]:
    for place in PLACES:
        path = ROOT / place
        for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
            if file.suffix in ENDINGS and file != Path(__file__):
                yield file, file.read_text(encoding="utf-8")


def sections_of(page: Path) -> list[int]:
    return [int(number) for number, _ in HEADING.findall(page.read_text(encoding="utf-8"))]


def anchors_of(page: Path) -> set[str]:
    """Anchors as GitHub makes them: lower case, punctuation dropped, spaces as hyphens."""
    text = page.read_text(encoding="utf-8")
    headings = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


def broken(text: str) -> list[str]:
    """Pages and sections that a text cites and that are not there."""
    missing = [page for page in PAGE.findall(text) if not (ROOT / page).exists()]
    for page, first, last in SECTIONS.findall(text):
        there = sections_of(ROOT / page) if (ROOT / page).exists() else []
        missing += [
            f"{page}, section {number}" for number in range(int(first), int(last or first) + 1) if number not in there
        ]
    return missing


def test_every_cited_page_and_section_exists():
    missing = {str(file.relative_to(ROOT)): found for file, text in files() if (found := broken(text))}
    assert not missing
    cited = [match for _, text in files() for match in SECTIONS.findall(text)]
    assert len(cited) >= 15


def test_links_to_sections_lead_somewhere():
    for file, text in files():
        if file.suffix != ".md":
            continue
        for page, anchor in LINK.findall(text):
            target = file.parent / page if page else file
            assert anchor in anchors_of(target), f"{file.name}: #{anchor}"


@pytest.mark.parametrize("page", ["theory.md", "results.md"])
def test_sections_are_numbered_without_gaps(page):
    numbers = sections_of(ROOT / "docs" / page)
    assert numbers == list(range(1, len(numbers) + 1))
    assert len(numbers) >= 3


@pytest.mark.parametrize(
    ("text", "missing"),
    [
        ("see docs/theory.md, section 2.", []),
        ("see docs/theory.md,\n# sections 2 and 4)", []),
        ("see docs/theory.md, section 77", ["docs/theory.md, section 77"]),
        ("see docs/theory.md, sections 98 to 99", ["docs/theory.md, section 98", "docs/theory.md, section 99"]),
        ("see docs/thoery.md, section 1", ["docs/thoery.md", "docs/thoery.md, section 1"]),
    ],
)
def test_a_broken_citation_is_found(text, missing):
    assert broken(text) == missing
