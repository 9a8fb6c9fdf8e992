// The table of configurations: sorted, filtered, with a drawing of each design and the reason behind each status.

import { thumbnail } from "./drawing.mjs";
import {
  choice,
  element,
  headingOf,
  labelled,
  shownValue,
  significant,
  typographic,
  valueOf,
  withGoals,
} from "./format.mjs";
import { change, state } from "./state.mjs";

const SHOWN = [
  "rank",
  "configuration",
  "status",
  "depth_error_rms",
  "limit_ratio",
  "height_mm",
  "diameter_mm",
  "mass_g",
  "largest_blur_px",
  "f_number",
  "baseline_mm",
];
const SHORT = { largest_blur_px: "blur", mass_g: "mass", rank: "rank" };
const STATUSES = ["feasible", "infeasible", "failed", "impossible", "not judged"];
const NUMBERS = ["depth_error_rms", "limit_ratio", "height_mm", "diameter_mm", "mass_g", "largest_blur_px", "f_number"];

/** Build table and filters; returns what marks the selected row. */
export function buildTable(data) {
  const { rows, columns, designs } = data;
  const shown = [...SHOWN, ...(rows.some((row) => row.check) ? ["check"] : [])];
  const order = { name: null, falling: false };
  const filter = { text: "", statuses: new Set(STATUSES), family: "", column: NUMBERS[0], sense: "most", bound: null };
  const open = new Set();
  const body = element("tbody");
  const heads = new Map();
  const count = document.getElementById("count");
  const isStarred = rows.some((row) => row.beyond_first_order);
  const lines = new Map(rows.map((row) => [row.configuration, lineOfRow(row)]));

  function lineOfRow(row) {
    const name = row.configuration;
    const design = designs[name];
    const button = element(
      "button",
      { type: "button", "aria-expanded": "false", click: () => toggle(name), keydown: step },
      name,
    );
    const cells = shown.map((column) => {
      if (column === "configuration") return element("td", { class: "name" }, button);
      if (column === "status")
        return element("td", {}, element("span", { class: `status ${row.status.replace(" ", "-")}` }, row.status));
      // Hidden where it does not apply, so that the digits stay in line.
      const star = column === "depth_error_rms" && isStarred ? element("span", { class: "star" }, " *") : null;
      star?.classList.toggle("off", !row.beyond_first_order);
      const style = columns[column].is_number ? "number" : null;
      return element("td", { class: style }, shownValue(row, column, columns), star);
    });
    const line = element(
      "tr",
      { "data-name": name },
      element("td", { class: "drawing" }, design ? thumbnail(design) : null),
      ...cells,
    );
    const why = element("tr", { class: "reason", hidden: true });
    return { row, line, why, button };
  }

  function toggle(name) {
    const { row, why, button } = lines.get(name);
    const opens = !open.has(name);
    if (opens) open.add(name);
    else open.delete(name);
    if (opens && !why.childElementCount) {
      why.append(
        element("td", { colspan: shown.length + 1 }, ...explanation(row, designs[row.configuration], columns)),
      );
    }
    why.hidden = !opens;
    button.setAttribute("aria-expanded", String(opens));
    if (opens) change({ selected: name });
  }

  function step(event) {
    const ways = { ArrowDown: 1, ArrowUp: -1 };
    if (!(event.key in ways)) return;
    event.preventDefault();
    const buttons = [...body.querySelectorAll("td.name button")];
    buttons[buttons.indexOf(event.currentTarget) + ways[event.key]]?.focus();
  }

  function sortBy(name) {
    if (order.name === name && !order.falling) order.falling = true;
    else if (order.name === name) order.name = null;
    else Object.assign(order, { name, falling: false });
    fill();
  }

  function passes(row) {
    if (!filter.statuses.has(row.status) || (filter.family && row.family !== filter.family)) return false;
    const words = `${row.configuration} ${row.variant ?? ""} ${row.reason ?? ""} ${row.lens ?? ""}`.toLowerCase();
    if (
      filter.text &&
      !filter.text
        .toLowerCase()
        .split(/\s+/)
        .every((word) => words.includes(word))
    )
      return false;
    if (filter.bound === null) return true;
    const value = valueOf(row, filter.column, columns);
    return value !== null && (filter.sense === "most" ? value <= filter.bound : value >= filter.bound);
  }

  function fill() {
    const kept = rows.filter(passes);
    if (order.name) {
      const key = (row) => valueOf(row, order.name, columns);
      kept.sort((one, other) => {
        const [a, b] = [key(one), key(other)];
        // Rows without a value come last either way.
        if (a === null || b === null) return (a === null) - (b === null);
        const difference = typeof a === "number" ? a - b : a.localeCompare(b, "en");
        return order.falling ? -difference : difference;
      });
    }
    body.replaceChildren(
      ...kept.flatMap((row) => {
        const { line, why } = lines.get(row.configuration);
        return [line, why];
      }),
    );
    for (const [name, head] of heads) {
      const sort = order.name === name ? (order.falling ? "descending" : "ascending") : "none";
      head.setAttribute("aria-sort", sort);
      head.querySelector(".way").textContent = { ascending: " ▲", descending: " ▼", none: "" }[sort];
    }
    const note = kept.some((row) => row.beyond_first_order)
      ? "; * first order underestimates the worst point of the working volume"
      : "";
    count.textContent = `${kept.length} of ${rows.length} configurations shown${note}`;
  }

  function head(name) {
    const column = columns[name];
    const label = SHORT[name] ? (column.unit ? `${SHORT[name]} (${column.unit})` : SHORT[name]) : headingOf(column);
    const button = element(
      "button",
      { type: "button", title: `Sort by ${column.label}`, click: () => sortBy(name) },
      label,
    );
    button.append(element("span", { class: "way", "aria-hidden": "true" }));
    const cell = element(
      "th",
      { scope: "col", class: column.is_number ? "number" : null, "aria-sort": "none" },
      button,
    );
    heads.set(name, cell);
    return cell;
  }

  document
    .getElementById("table")
    .append(
      element("thead", {}, element("tr", {}, element("th", { scope: "col" }, "section"), ...shown.map(head))),
      body,
    );
  document.getElementById("filters").append(...filters(filter, rows, columns, fill));
  fill();
  return () => {
    for (const [name, { line }] of lines) line.classList.toggle("selected", name === state.selected);
  };
}

function filters(filter, rows, columns, changed) {
  const set = (values) => {
    Object.assign(filter, values);
    changed();
  };
  const search = element("input", {
    type: "search",
    id: "search",
    placeholder: "name, variant or reason",
    input: () => set({ text: search.value.trim() }),
  });
  const bound = element("input", {
    type: "number",
    step: "any",
    "aria-label": "Bound",
    placeholder: "any",
    input: () => set({ bound: bound.value === "" ? null : Number(bound.value) }),
  });
  const boxes = STATUSES.filter((status) => rows.some((row) => row.status === status)).map((status) => {
    const box = element("input", {
      type: "checkbox",
      checked: true,
      change: () => {
        if (box.checked) filter.statuses.add(status);
        else filter.statuses.delete(status);
        changed();
      },
    });
    return element("label", {}, box, status);
  });
  const families = [
    ["", "all"],
    ["direct", "direct"],
    ["folded", "folded"],
  ];
  const sense = choice(
    [
      ["most", "at most"],
      ["least", "at least"],
    ],
    "most",
    (value) => set({ sense: value }),
  );
  sense.setAttribute("aria-label", "At most or at least");
  const column = choice(
    withGoals(NUMBERS, data).map((name) => [name, headingOf(columns[name])]),
    filter.column,
    (value) => set({ column: value }),
  );
  return [
    labelled("Search", search),
    labelled(
      "Family",
      choice(families, "", (value) => set({ family: value })),
    ),
    labelled("Only with", column),
    sense,
    bound,
    element("fieldset", {}, element("legend", {}, "Status"), ...boxes),
  ];
}

/** Why a configuration has its status, and for a design what else is worth knowing. */
export function explanation(row, design, columns) {
  const sentence = (text) => element("p", {}, typographic(text));
  const reason = row.reason ?? "no reason is recorded";
  if (row.status === "impossible") {
    return [element("p", {}, element("strong", {}, "Impossible: "), typographic(reason))];
  }
  if (row.status === "infeasible") {
    const closest = row.closest_constraint
      ? `Limiting constraint: ${row.closest_constraint}, violated by ` +
        `${significant(row.closest_violation)} ${row.closest_unit ?? ""} at the nearest point found.`
      : null;
    const effort = row.solves
      ? `The solver ran ${row.solves} times from ${row.starts ?? "several"} starts. That is a search, not a proof.`
      : null;
    return [
      element("p", {}, element("strong", {}, "No feasible design found: "), typographic(reason)),
      closest && sentence(closest),
      effort && sentence(effort),
    ];
  }
  if (row.status === "failed")
    return [element("p", {}, element("strong", {}, "The computation failed: "), typographic(reason))];
  const facts = [
    row.variant,
    row.lens && `lens: ${row.lens}`,
    row.depth_error_worst !== undefined && `worst depth error ${shownValue(row, "depth_error_worst", columns)} %`,
    row.smallest_clearance_mm !== undefined &&
      `least clearance ${shownValue(row, "smallest_clearance_mm", columns)} mm ` +
        `(${row.smallest_clearance_where ?? "place not recorded"})`,
    row.check && `end-to-end check: ${row.check}`,
    row.pareto_front_problem && `no Pareto front: ${row.pareto_front_problem}`,
  ].filter(Boolean);
  const show = (values, place) => () => {
    change(values);
    document.getElementById(place).scrollIntoView();
  };
  return [
    sentence(
      `${row.status === "feasible" ? "Feasible" : "As recorded; designer trace judges it"}: ${facts.join("; ")}.`,
    ),
    ...(design?.notes ?? []).map((note) => sentence(`Before ordering: ${note}.`)),
    element(
      "p",
      { class: "quick" },
      element("button", { type: "button", click: show({ selected: row.configuration }, "rays") }, "Live ray"),
      element("button", { type: "button", click: show({ selected: row.configuration }, "rig") }, "3-D"),
      element("button", { type: "button", click: show({ first: row.configuration }, "side-by-side") }, "Compare as A"),
      element("button", { type: "button", click: show({ second: row.configuration }, "side-by-side") }, "Compare as B"),
    ),
  ];
}
