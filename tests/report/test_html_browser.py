"""study.html in a headless Chromium, opened from disk: what it shows and does, without network and errors."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from sample_study import NASTY_TITLE, prototype, two_direct_mirrors, write_sample_study

from designer.report.html.document import write_html
from designer.study.folder import read_study
from support.chromium import CHROMIUM, Tab, tab

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed: the page cannot be opened"),
]
NAMES = "[...document.querySelectorAll('#table tbody tr[data-name]')].map((row) => row.dataset.name)"
SELECTED = "document.querySelector('#table tr.selected').dataset.name"
READY = (
    "document.querySelectorAll('#table tbody tr[data-name]').length === 44 && !!document.querySelector('.ray-upper')"
)


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    designs = (prototype(), two_direct_mirrors(), prototype(topology="upper_inner"), prototype(direct_kind="ellipsoid"))
    folder = write_sample_study(tmp_path_factory.mktemp("browser") / "sample", designs=designs)
    return write_html(read_study(folder), folder)


@pytest.fixture
def opened(page: Path, tmp_path: Path) -> Iterator[Tab]:
    with tab(tmp_path / "profile") as shown:
        shown.open(page.as_uri())
        assert shown.becomes_true(READY)
        yield shown
        assert shown.problems == []
        assert [url for url in shown.requests if url != page.as_uri() and not url.startswith("data:")] == []


def test_the_first_paint_comes_within_a_second(opened: Tab) -> None:
    paint = opened.value("performance.getEntriesByName('first-contentful-paint')[0].startTime")
    assert 0.0 < paint < 1000.0
    assert opened.value("document.title") == NASTY_TITLE


def test_the_table_sorts_and_filters(opened: Tab) -> None:
    click = "[...document.querySelectorAll('#table thead button')].find((b) => b.title === 'Sort by height').click()"
    place = "[...document.querySelectorAll('#table thead th')].findIndex((th) => th.ariaSort !== 'none' && th.ariaSort)"
    opened.value(click)
    cells = f"[...document.querySelectorAll('#table tbody tr[data-name]')].map((r) => r.cells[{place}].textContent)"
    heights = [float(text) for text in opened.value(cells) if text != "–"]
    assert len(heights) == 4
    assert heights == sorted(heights)
    opened.value(click)
    falling = [float(text) for text in opened.value(cells)[:4]]
    assert falling == sorted(heights, reverse=True)
    opened.value("document.querySelector('#filters fieldset input').click()")  # feasible
    assert len(opened.value(NAMES)) == 40
    opened.value("{const s=document.querySelector('#search'); s.value='PaPa-El'; s.dispatchEvent(new Event('input'))}")
    assert set(opened.value(NAMES)) == {"folded-PaPa-El-upper_outer", "folded-PaPa-El-upper_inner"}


def test_a_click_on_a_name_tells_the_reason(opened: Tab) -> None:
    name = "direct-ElEl-upper_outer"
    opened.value(f"document.querySelector('tr[data-name={name}] button').click()")
    told = opened.value(f"document.querySelector('tr[data-name={name}] + tr.reason').innerText")
    assert told.startswith(("Impossible: ", "No feasible design found: "))
    assert len(told) > 40


def test_a_click_in_the_plot_selects_in_the_table_and_for_the_ray(opened: Tab) -> None:
    name = "direct-HyHy-upper_outer"
    assert opened.value(SELECTED) != name
    before = opened.value("document.querySelector('.ray-upper').getAttribute('d')")
    spot = opened.value(
        f"(() => {{ const mark = document.querySelector('#trade [data-name={name}]');"
        " mark.scrollIntoView({behavior: 'instant', block: 'center'});"
        " const box = mark.getBoundingClientRect(); return [box.x + box.width / 2, box.y + box.height / 2]; })()"
    )
    for kind in ("mousePressed", "mouseReleased"):
        opened.ask("Input.dispatchMouseEvent", type=kind, x=spot[0], y=spot[1], button="left", clickCount=1)
    assert opened.value(SELECTED) == name
    assert opened.value("document.querySelector('#ray-controls select').value") == name
    assert opened.value("document.querySelector('.ray-upper').getAttribute('d')") != before


def test_a_slider_moves_the_ray_within_100_ms(opened: Tab) -> None:
    seen = "['.ray-upper', '.ray-lower'].map((ray) => document.querySelector(ray).getAttribute('d'))"
    for slider in ("elevationShare", "distanceShare"):
        before, readings = opened.value(seen), opened.value("document.querySelector('.reading').textContent")
        elapsed = opened.value(
            f"(() => {{ const input = document.querySelector('#slider-{slider}'); const start = performance.now();"
            " input.value = 0.9; input.dispatchEvent(new Event('input')); document.body.offsetHeight;"
            " return performance.now() - start; })()"
        )
        after = opened.value(seen)
        assert before[0] != after[0]
        assert before[1] != after[1]
        assert opened.value("document.querySelector('.reading').textContent") != readings
        assert elapsed < 100.0


def test_the_keyboard_reaches_rows_marks_and_ray(opened: Tab) -> None:
    opened.value("document.querySelector('#table td.name button').focus()")
    opened.ask("Input.dispatchKeyEvent", type="keyDown", key="ArrowDown", code="ArrowDown", windowsVirtualKeyCode=40)
    assert opened.value("document.activeElement.textContent") == opened.value(NAMES)[1]
    opened.value("document.querySelector('#trade .mark[tabindex=\"0\"]').focus()")
    visited = []
    for key, code in [("ArrowLeft", 37)] * 3 + [("ArrowRight", 39)] * 3:
        opened.ask("Input.dispatchKeyEvent", type="keyDown", key=key, code=key, windowsVirtualKeyCode=code)
        visited.append(opened.value("document.activeElement.dataset.name"))
    assert len(set(visited)) == 4
    name = visited[-1]
    assert opened.value(SELECTED) != name
    opened.ask("Input.dispatchKeyEvent", type="keyDown", key="Enter", code="Enter", windowsVirtualKeyCode=13)
    assert opened.value(SELECTED) == name


def assert_keys_turn_the_rig(shown: Tab) -> None:
    picture = "(() => { const c = document.querySelector('#rig canvas'); c.focus(); return c.toDataURL(); })()"
    blank = shown.value(
        "(() => { const c = document.querySelector('#rig canvas'), d = document.createElement('canvas');"
        " d.width = c.width; d.height = c.height; return d.toDataURL(); })()"
    )
    shown.becomes_true("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))")
    before = shown.value(picture)
    assert len(before) > 3 * len(blank)
    shown.ask("Input.dispatchKeyEvent", type="keyDown", key="ArrowRight", code="ArrowRight", windowsVirtualKeyCode=39)
    shown.becomes_true("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))")
    assert shown.value(picture) != before


def test_an_address_may_name_a_design(page: Path, tmp_path: Path) -> None:
    with tab(tmp_path / "profile") as shown:
        for fragment, selected in (("#design=direct-HyHy-upper_outer", "direct-HyHy-upper_outer"), ("#design=%", None)):
            shown.open("about:blank")
            shown.open(page.as_uri() + fragment)
            assert shown.becomes_true(READY)
            assert shown.value(SELECTED) == (selected or shown.value(NAMES)[0])
        assert shown.problems == []


def test_the_rig_is_drawn_or_a_line_says_why_not(page: Path, tmp_path: Path) -> None:
    drawn = "!!document.querySelector('#rig.drawn canvas')"
    told = "!!document.querySelector('#no-webgl')"
    with tab(tmp_path / "with") as shown:
        shown.open(page.as_uri())
        assert shown.becomes_true(READY)
        shown.value("document.querySelector('#rig').scrollIntoView()")
        assert shown.becomes_true(f"{drawn} || {told}")
        if shown.value(drawn):
            assert_keys_turn_the_rig(shown)
        assert shown.problems == []
    with tab(tmp_path / "without", "--disable-3d-apis") as shown:
        shown.open(page.as_uri())
        assert shown.becomes_true(READY)
        shown.value("document.querySelector('#rig').scrollIntoView()")
        assert shown.becomes_true(told)
        assert not shown.value(drawn)
        assert shown.value("document.querySelectorAll('#compare figure svg').length") == 2
        assert shown.problems == []
