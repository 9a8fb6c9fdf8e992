// Elements, and numbers as people read them.

const SVG = "http://www.w3.org/2000/svg";

/** An HTML element; attributes that are functions listen to the event of their name. */
export function element(tag, attributes = {}, ...children) {
  return furnished(document.createElement(tag), attributes, children);
}

/** The same for SVG. */
export function shape(tag, attributes = {}, ...children) {
  return furnished(document.createElementNS(SVG, tag), attributes, children);
}

function furnished(made, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") made.addEventListener(name, value);
    else if (value === true) made.setAttribute(name, "");
    else if (value !== null && value !== undefined && value !== false) made.setAttribute(name, value);
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

/** A number with fixed decimals and a true minus sign; a dash if there is none. */
export function fixed(value, decimals, unit = "") {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const rounded = value.toFixed(decimals);
  const text = Number(rounded) === 0 ? rounded.replace("-", "") : rounded.replace("-", "−");
  return unit ? `${text}${unit === "°" ? "" : " "}${unit}` : text;
}

/** A number with three significant digits. */
export function significant(value) {
  if (!Number.isFinite(value)) return "–";
  return String(Number(value.toPrecision(3))).replace("-", "−");
}

/** A sentence of the program's with true minus signs and arrows. */
export function typographic(sentence) {
  return sentence.replace(/(?<![\w-])-(?=\d)/g, "−").replaceAll("->", "→");
}

/** A distance in mm as people say it: in m from one metre up. */
export function length(value) {
  return value >= 1000 ? `${fixed(value / 1000, 3)} m` : `${fixed(value, 0)} mm`;
}

/** Decimals that suit a column. */
export function decimalsOf(name, column) {
  if (name === "rank" || name === "starts" || name === "solves") return 0;
  if (column.unit === "%" || name === "limit_ratio") return 3;
  if (name === "f_number" || column.unit === "°") return 2;
  return 1;
}

/** A list of columns, and those of the goals that it leaves out. */
export function withGoals(names, data) {
  return [...names, ...data.goals.filter((name) => !names.includes(name))];
}

/** A row's value of a column in the column's unit, or null. */
export function valueOf(row, name, columns) {
  const value = row[name];
  if (value === undefined || value === null) return null;
  return columns[name].is_number ? value * columns[name].factor : value;
}

/** A row's value of a column for people, without the unit. */
export function shownValue(row, name, columns) {
  const value = valueOf(row, name, columns);
  if (value === null) return name === "focus_distance_mm" && row.depth_error_rms !== undefined ? "∞" : "–";
  return columns[name].is_number ? fixed(value, decimalsOf(name, columns[name])) : typographic(value);
}

/** Label and unit of a column. */
export function headingOf(column) {
  return column.unit ? `${column.label} (${column.unit})` : column.label;
}

/** Round values that span a range, about so many. */
export function roundTicks(low, high, wanted) {
  const rough = (high - low) / wanted;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((digit) => digit * power).find((each) => each >= rough * 0.999);
  const ticks = [];
  for (let place = Math.ceil(low / step - 1e-9); place * step <= high + step * 1e-9; place += 1) {
    ticks.push(place * step);
  }
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return ticks.map((value) => [value, fixed(value, decimals)]);
}

/** Round values 1, 2, 5 of every power of ten within a range above zero. */
export function roundPowers(low, high) {
  const ticks = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power += 1) {
    for (const digit of [1, 2, 5]) {
      const value = Number(`${digit}e${power}`);
      if (value >= low && value <= high) ticks.push([value, fixed(value, Math.max(-power, 0))]);
    }
  }
  return ticks;
}

/** A labelled control. */
export function labelled(text, control) {
  return element("label", {}, text, control);
}

/** A select of [value, text] pairs. */
export function choice(options, chosen, changed) {
  const select = element("select", { change: () => changed(select.value) });
  for (const [value, text] of options) {
    select.append(element("option", { value, selected: value === chosen }, text));
  }
  return select;
}

// What fits across a sheet of A4, in CSS pixels.
const PAPER_WIDTH = 690;
const WIDE_ENOUGH = 656;
let isOnPaper = false;

/** The width that a drawing has there, on screen or on paper. */
export function widthOf(place) {
  return isOnPaper ? PAPER_WIDTH : place.clientWidth;
}

/** Whether two drawings fit side by side; style.css has the same bound. */
export function isWide(place) {
  return widthOf(place) >= WIDE_ENOUGH;
}

/** Call a function when the width that an element offers has changed: on screen, or for paper and back. */
export function onResize(place, changed) {
  let width = place.clientWidth;
  addEventListener("resize", () => {
    if (place.clientWidth === width || !place.clientWidth) return;
    width = place.clientWidth;
    changed();
  });
  const turnTo = (paper) => () => {
    isOnPaper = paper;
    changed();
  };
  addEventListener("beforeprint", turnTo(true));
  addEventListener("afterprint", turnTo(false));
}
