// Any two figures of merit of the feasible designs against each other, with the Pareto fronts where they apply.

import {
  choice,
  decimalsOf,
  element,
  fixed,
  headingOf,
  labelled,
  onResize,
  roundPowers,
  roundTicks,
  shape,
  valueOf,
  widthOf,
  withGoals,
} from "./format.mjs";
import { change, state, whenChanged } from "./state.mjs";

const AXES = [
  "height_mm",
  "diameter_mm",
  "depth_error_rms",
  "largest_blur_px",
  "largest_blur_deg",
  "mass_g",
  "limit_ratio",
  "volume_cm3",
  "f_number",
  "depth_error_worst",
  "depth_shift_per_scale",
  "largest_slope_deg",
];
const SERIES = [
  ["#0072b2", null],
  ["#d55e00", "7 3"],
  ["#00795a", "7 3 2 3"],
  ["#b0588c", "2 3"],
  ["#8a6100", "12 4"],
];
// Beyond this many times a front's least error its points say only that the end is near.
const FRONT_SPAN = 2;
// From this ratio of the largest value to the least an axis is logarithmic.
const WIDE = 6;
const MARGIN = { left: 66, right: 20, top: 14, bottom: 48 };

/** Build the plot and its controls. */
export function buildTrade(data) {
  const { rows, columns, fronts } = data;
  const place = document.getElementById("trade");
  const axes = withGoals(AXES, data).filter((name) => rows.filter((row) => row[name] !== undefined).length > 0);
  const count = rows.filter((row) => row.depth_error_rms !== undefined).length;
  if (axes.length < 2 || (count < 2 && !fronts.length)) {
    const words = count
      ? "There is only one design, so there is nothing to trade."
      : "No configuration is feasible, so there is nothing to trade.";
    place.append(element("p", { class: "notice" }, words));
    return;
  }
  const shown = {
    x: axes.includes("height_mm") ? "height_mm" : axes[0],
    y: axes.includes("depth_error_rms") ? "depth_error_rms" : axes[1],
    fronts: true,
  };
  const options = axes.map((name) => [name, headingOf(columns[name])]);
  const box = element("input", { type: "checkbox", checked: true, change: () => set({ fronts: box.checked }) });
  const draw = () => drawTrade(place, shown, data);
  const set = (values) => {
    Object.assign(shown, values);
    draw();
  };
  document.getElementById("trade-controls").append(
    labelled(
      "Across",
      choice(options, shown.x, (value) => set({ x: value })),
    ),
    labelled(
      "Up",
      choice(options, shown.y, (value) => set({ y: value })),
    ),
    ...(fronts.length
      ? [element("label", { class: "check" }, box, "Pareto fronts, where they belong to these axes")]
      : []),
  );
  draw();
  onResize(place, draw);
  whenChanged((changed) => {
    if (changed.has("selected")) draw();
  });
}

/** The Pareto fronts that belong to the two axes, as lines of points in the columns' units. */
export function frontsOn(x, y, data) {
  const swept = x === "depth_error_rms" ? y : x;
  if (y !== "depth_error_rms" && x !== "depth_error_rms") return [];
  const points = data.fronts.filter((point) => point.swept === swept && point.depth_error_rms !== null);
  const ranks = new Map(data.rows.map((row) => [row.configuration, row.rank ?? Infinity]));
  const names = [...new Set(points.map((point) => point.configuration))].sort((a, b) => ranks.get(a) - ranks.get(b));
  return names.slice(0, SERIES.length).map((name, place) => {
    const own = points.filter((point) => point.configuration === name).sort((a, b) => a.limit_mm - b.limit_mm);
    const least = Math.min(...own.map((point) => point.depth_error_rms));
    const line = own
      .filter((point) => point.depth_error_rms <= FRONT_SPAN * least)
      .map((point) => {
        const values = { depth_error_rms: 100 * point.depth_error_rms, [swept]: point.limit_mm };
        return [values[x], values[y]];
      });
    return { name, line, style: SERIES[place] };
  });
}

/** From values to places on paper: a span with room around it, logarithmic where the values differ widely. */
function scaleOf(values, from, end, wanted) {
  const [least, most] = [Math.min(...values), Math.max(...values)];
  const isWide = least > 0 && most > WIDE * least;
  const bend = isWide ? Math.log : (value) => value;
  // Near-ties differ by the solver's noise: never zoom in until that looks like a trade.
  const room = isWide ? 0.06 * Math.log(most / least) : Math.max(0.1 * (most - least), 0.02 * Math.abs(most), 1e-9);
  const [low, high] = [bend(least) - room, bend(most) + room];
  const ticks = isWide ? roundPowers(Math.exp(low), Math.exp(high)) : roundTicks(low, high, wanted);
  return {
    to: (value) => from + ((bend(value) - low) / (high - low)) * (end - from),
    holds: (value) => bend(value) >= low && bend(value) <= high,
    ticks,
    note: isWide ? ", logarithmic" : "",
  };
}

function drawTrade(place, shown, data) {
  const { rows, columns, envelope } = data;
  const { x, y } = shown;
  const points = rows
    .map((row) => ({ row, at: [valueOf(row, x, columns), valueOf(row, y, columns)] }))
    .filter(({ at }) => at[0] !== null && at[1] !== null);
  const lines = shown.fronts ? frontsOn(x, y, data) : [];
  const width = Math.max(widthOf(place), 300);
  const height = Math.round(Math.min(520, Math.max(320, 0.6 * width)));
  const all = [...points.map(({ at }) => at), ...lines.flatMap(({ line }) => line)];
  const scales = [
    scaleOf(
      all.map((at) => at[0]),
      MARGIN.left,
      width - MARGIN.right,
      width < 500 ? 4 : 7,
    ),
    scaleOf(
      all.map((at) => at[1]),
      height - MARGIN.bottom,
      MARGIN.top,
      6,
    ),
  ];
  const [{ to: toX }, { to: toY }] = scales;
  const tips = element("div", { class: "tip", hidden: true });
  const parts = [];
  for (const [value, text] of scales[0].ticks) {
    parts.push(shape("path", { d: `M${toX(value)} ${MARGIN.top}V${height - MARGIN.bottom}`, stroke: "#e4e4e4" }));
    parts.push(
      shape("text", { x: toX(value), y: height - MARGIN.bottom + 17, "font-size": 12, "text-anchor": "middle" }, text),
    );
  }
  for (const [value, text] of scales[1].ticks) {
    parts.push(shape("path", { d: `M${MARGIN.left} ${toY(value)}H${width - MARGIN.right}`, stroke: "#e4e4e4" }));
    parts.push(shape("text", { x: MARGIN.left - 7, y: toY(value) + 4, "font-size": 12, "text-anchor": "end" }, text));
  }
  const corner = `M${MARGIN.left} ${MARGIN.top}V${height - MARGIN.bottom}H${width - MARGIN.right}`;
  parts.push(shape("path", { d: corner, stroke: "#1a1a1a", fill: "none" }));
  const middle = (MARGIN.top + height - MARGIN.bottom) / 2;
  parts.push(
    shape(
      "text",
      { x: (MARGIN.left + width - MARGIN.right) / 2, y: height - 8, "font-size": 13, "text-anchor": "middle" },
      headingOf(columns[x]) + scales[0].note,
    ),
  );
  parts.push(
    shape(
      "text",
      { transform: `translate(15 ${middle}) rotate(-90)`, "font-size": 13, "text-anchor": "middle" },
      headingOf(columns[y]) + scales[1].note,
    ),
  );
  parts.push(...boundary(envelope, x, y, scales, width, height));
  for (const { line, style } of lines) {
    const d = line.map(([a, b], index) => `${index ? "L" : "M"}${toX(a).toFixed(1)} ${toY(b).toFixed(1)}`).join("");
    parts.push(shape("path", { d, fill: "none", stroke: style[0], "stroke-width": 1.8, "stroke-dasharray": style[1] }));
    for (const [a, b] of line) parts.push(shape("circle", { cx: toX(a), cy: toY(b), r: 2.2, fill: style[0] }));
  }
  const marks = points.map(({ row, at }) => mark(row, [toX(at[0]), toY(at[1])], at, shown, columns, tips, place));
  // The selected mark lies on top; it is the one that the tab key reaches, and arrow keys lead to the others.
  marks.sort((one, other) => (one.dataset.name === state.selected) - (other.dataset.name === state.selected));
  marks.at(-1)?.setAttribute("tabindex", "0");
  const label = `${columns[y].label} against ${columns[x].label} of ${points.length} designs`;
  place.className = "plot";
  place.replaceChildren(
    shape(
      "svg",
      { viewBox: `0 0 ${width} ${height}`, role: "group", "aria-label": label },
      ...parts,
      ...ranks(points, toX, toY, width, height),
      ...marks,
    ),
    tips,
    legend(points, lines),
  );
}

/** The envelope as a line, where one of the axes has one within reach. */
function boundary(envelope, x, y, scales, width, height) {
  const parts = [];
  const style = { stroke: "#1a1a1a", "stroke-dasharray": "6 4" };
  const text = { "font-size": 11.5, class: "halo" };
  if (envelope[x] && scales[0].holds(envelope[x])) {
    const at = scales[0].to(envelope[x]);
    parts.push(shape("path", { d: `M${at} ${MARGIN.top}V${height - MARGIN.bottom}`, ...style }));
    parts.push(shape("text", { ...text, x: at - 4, y: MARGIN.top + 11, "text-anchor": "end" }, "envelope"));
  }
  if (envelope[y] && scales[1].holds(envelope[y])) {
    const at = scales[1].to(envelope[y]);
    parts.push(shape("path", { d: `M${MARGIN.left} ${at}H${width - MARGIN.right}`, ...style }));
    parts.push(shape("text", { ...text, x: MARGIN.left + 6, y: at - 5 }, "envelope"));
  }
  return parts;
}

function mark(row, [cx, cy], at, { x, y }, columns, tips, place) {
  const name = row.configuration;
  const value = (axis, column) =>
    `${columns[column].label} ${fixed(at[axis], decimalsOf(column, columns[column]), columns[column].unit)}`;
  const words = `${row.rank ? `${row.rank}  ` : ""}${name}: ${value(0, x)}, ${value(1, y)}`;
  const symbol =
    row.family === "direct"
      ? shape("circle", { cx, cy, r: 6.5, fill: "#fff", "fill-opacity": 0.01, stroke: "#0072b2", "stroke-width": 2 })
      : shape("rect", {
          x: cx - 5,
          y: cy - 5,
          width: 10,
          height: 10,
          fill: "#d55e00",
          "fill-opacity": 0.55,
          stroke: "#d55e00",
        });
  const ring =
    name === state.selected
      ? shape("circle", { cx, cy, r: 9.5, fill: "none", stroke: "#1a1a1a", "stroke-width": 2.2 })
      : null;
  const show = () => {
    tips.textContent = words;
    tips.hidden = false;
    const drawing = place.querySelector("svg").getBoundingClientRect();
    const ratio = drawing.width / place.querySelector("svg").viewBox.baseVal.width;
    const isRight = cx * ratio > drawing.width / 2;
    tips.style.left = isRight ? "auto" : `${cx * ratio + 14}px`;
    tips.style.right = isRight ? `${drawing.width - cx * ratio + 14}px` : "auto";
    tips.style.top = `${cy * ratio - 12}px`;
  };
  const hide = () => {
    tips.hidden = true;
  };
  const select = () => {
    change({ selected: name });
    place.querySelector(`[data-name="${CSS.escape(name)}"]`)?.focus();
  };
  return shape(
    "g",
    {
      class: "mark",
      tabindex: "-1",
      role: "button",
      "aria-label": words,
      "aria-pressed": String(name === state.selected),
      "data-name": name,
      mouseenter: show,
      mouseleave: hide,
      focus: show,
      blur: hide,
      click: select,
      keydown: (event) => {
        const ways = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 };
        const isChosen = event.key === "Enter" || event.key === " ";
        if (!isChosen && !(event.key in ways)) return;
        event.preventDefault();
        if (isChosen) select();
        else neighbour(place, event.currentTarget, ways[event.key])?.focus();
      },
    },
    ring,
    symbol,
  );
}

/** The mark to the right of another, or with a step of -1 to its left. */
function neighbour(place, from, step) {
  const marks = [...place.querySelectorAll(".mark")];
  const left = new Map(marks.map((each) => [each, each.getBoundingClientRect().left]));
  marks.sort(
    (one, other) => left.get(one) - left.get(other) || one.dataset.name.localeCompare(other.dataset.name, "en"),
  );
  return marks[marks.indexOf(from) + step];
}

/** Ranks beside the points, as far as they find room. */
function ranks(points, toX, toY, width, height) {
  const taken = points.map(({ at }) => [toX(at[0]) - 6, toY(at[1]) - 6, toX(at[0]) + 6, toY(at[1]) + 6]);
  const isFree = (box) =>
    box[0] > MARGIN.left &&
    box[2] < width - 2 &&
    box[1] > 2 &&
    box[3] < height - MARGIN.bottom &&
    !taken.some((other) => box[0] < other[2] && other[0] < box[2] && box[1] < other[3] && other[1] < box[3]);
  const labels = [];
  for (const { row, at } of points) {
    if (!row.rank) continue;
    const text = String(row.rank);
    const half = 3.6 * text.length;
    const [x, y] = [toX(at[0]), toY(at[1])];
    for (const [aside, up] of [
      [12, -10],
      [-12, -10],
      [12, 12],
      [-12, 12],
      [0, -15],
      [0, 17],
      [17, 1],
      [-17, 1],
    ]) {
      const box = [x + aside - half, y + up - 6, x + aside + half, y + up + 6];
      if (!isFree(box)) continue;
      taken.push(box);
      labels.push(
        shape("text", { x: x + aside, y: y + up + 4, "font-size": 12, "text-anchor": "middle", class: "halo" }, text),
      );
      break;
    }
  }
  return labels;
}

function legend(points, lines) {
  const entry = (drawing, text) =>
    element("span", {}, shape("svg", { viewBox: "0 0 34 14", "aria-hidden": "true" }, drawing), text);
  const families = [
    ["direct", shape("circle", { cx: 17, cy: 7, r: 5.5, fill: "none", stroke: "#0072b2", "stroke-width": 2 })],
    [
      "folded",
      shape("rect", { x: 12, y: 2, width: 10, height: 10, fill: "#d55e00", "fill-opacity": 0.55, stroke: "#d55e00" }),
    ],
  ];
  return element(
    "p",
    { class: "legend" },
    ...families
      .map(([family, drawing]) => [points.filter(({ row }) => row.family === family).length, family, drawing])
      .filter(([count]) => count)
      .map(([count, family, drawing]) => entry(drawing, `${family} (${count}), with its rank`)),
    ...lines.map(({ name, style }) =>
      entry(
        shape("path", { d: "M0 7H34", stroke: style[0], "stroke-width": 2, "stroke-dasharray": style[1] }),
        `Pareto front of ${name}`,
      ),
    ),
  );
}
