// Two designs side by side, at the same scale and with the live ray of the same place in the working volume.

import { extentOf } from "./drawing.mjs";
import {
  choice,
  decimalsOf,
  element,
  fixed,
  headingOf,
  isWide,
  labelled,
  onResize,
  shownValue,
  valueOf,
  widthOf,
  withGoals,
} from "./format.mjs";
import { VIEWS, imagedPoint } from "./optics.mjs";
import { optionText, raySection } from "./rays.mjs";
import { pointInWords, prescription } from "./readings.mjs";
import { change, scenePoint, state, whenChanged } from "./state.mjs";

const COMPARED = [
  "rank",
  "depth_error_rms",
  "depth_error_worst",
  "limit_ratio",
  "baseline_mm",
  "height_mm",
  "diameter_mm",
  "volume_cm3",
  "mass_g",
  "largest_mirror_diameter_mm",
  "largest_blur_px",
  "largest_blur_deg",
  "f_number",
  "principal_distance_mm",
  "focus_distance_mm",
  "depth_shift_per_scale",
  "largest_slope_deg",
  "smallest_clearance_mm",
];

/** Build the section. */
export function buildCompare(data) {
  const names = Object.keys(data.designs);
  const place = document.getElementById("compare");
  if (names.length < 2) {
    place.append(
      element("p", { class: "notice" }, "Fewer than two configurations are feasible, so there is nothing to compare."),
    );
    return;
  }
  const options = names.map((name) => [name, optionText(data, name)]);
  const first = choice(options, names[0], (name) => change({ first: name }));
  const second = choice(options, names[1], (name) => change({ second: name }));
  document.getElementById("compare-controls").append(labelled("A", first), labelled("B", second));
  let redraw = () => {};

  function build() {
    const designs = [data.designs[state.first], data.designs[state.second]];
    if (designs.some((design) => !design)) return;
    first.value = state.first;
    second.value = state.second;
    const width = Math.round(isWide(place) ? (widthOf(place) - 26) / 2 : widthOf(place));
    const extents = designs.map(extentOf);
    const common = {
      radius: Math.max(...extents.map((extent) => extent.radius)),
      low: Math.min(...extents.map((extent) => extent.low)),
      high: Math.max(...extents.map((extent) => extent.high)),
    };
    const sections = designs.map((design) => raySection(design, width, 460, common));
    const readings = element("tbody");
    place.replaceChildren(
      element(
        "div",
        { class: "pair" },
        ...sections.map(({ drawing }, index) =>
          element(
            "figure",
            {},
            drawing,
            element("figcaption", {}, `${"AB"[index]}: ${designs[index].configuration}. ${designs[index].variant}`),
          ),
        ),
      ),
      element(
        "div",
        { class: "scroll", tabindex: "0", role: "region", "aria-label": "Comparison" },
        element(
          "table",
          { class: "compared" },
          element(
            "thead",
            {},
            element(
              "tr",
              {},
              ...["", "A", "B", "B − A"].map((text, column) =>
                element("th", { scope: "col", class: column ? "number" : null }, text),
              ),
            ),
          ),
          element("tbody", {}, ...rowsOf(data)),
          readings,
        ),
      ),
      ...designs.flatMap((design, index) => [
        element("h3", {}, `Prescription of ${"AB"[index]}: ${design.configuration}`),
        prescription(design),
      ]),
    );
    redraw = () => updatePair(designs, sections, readings);
    redraw();
  }

  whenChanged((changed) => {
    if (changed.has("first") || changed.has("second")) build();
    else if (["elevationShare", "distanceShare", "view"].some((name) => changed.has(name))) redraw();
  });
  onResize(place, build);
}

function rowsOf(data) {
  const { columns } = data;
  const rows = [state.first, state.second].map((name) => data.rows.find((row) => row.configuration === name));
  const names = withGoals(COMPARED, data).filter((name) => rows.some((row) => row[name] !== undefined));
  return names.map((name) => {
    const values = rows.map((row) => valueOf(row, name, columns));
    const difference = values.some((value) => value === null) || name === "rank" ? null : values[1] - values[0];
    const texts = rows.map((row) => shownValue(row, name, columns));
    return comparedLine(headingOf(columns[name]), texts, difference, decimalsOf(name, columns[name]));
  });
}

function comparedLine(label, texts, difference, decimals) {
  const cell = (text) => element("td", { class: "number" }, text);
  const shown = difference === null ? "" : fixed(difference, decimals);
  const signed = difference > 0 && Number(difference.toFixed(decimals)) > 0 ? `+${shown}` : shown;
  return element("tr", {}, element("th", { scope: "row" }, label), ...texts.map(cell), cell(signed));
}

/** The live ray in both drawings, and what it gives, as the last rows of the table. */
function updatePair(designs, sections, readings) {
  const points = designs.map(scenePoint);
  const found = designs.map((design, index) => imagedPoint(design, points[index].elevation, points[index].distance));
  sections.forEach((section, index) => section.update(found[index]));
  const row = (label, of, decimals) => {
    const values = found.map(of);
    return comparedLine(
      label,
      values.map((value) => fixed(value, decimals)),
      values.includes(null) ? null : values[1] - values[0],
      decimals,
    );
  };
  readings.replaceChildren(
    element(
      "tr",
      {},
      element("th", { scope: "row", colspan: 4 }, `at ${pointInWords(points[0])} (set above, at the live ray)`),
    ),
    row("depth error (%)", (each) => (each.depthError === null ? null : 100 * each.depthError), 3),
    ...VIEWS.flatMap((name) => [
      row(`image radius, ${name} view (px)`, (each) => each.views[name].radiusPx, 1),
      row(`blur, ${name} view (px)`, (each) => each.views[name].blurPx, 2),
    ]),
  );
}
