// The live ray: one scene point, followed through both views of the selected design.

import {
  COLOUR,
  DASH,
  drawnAxis,
  drawnFans,
  drawnHardware,
  drawnImage,
  drawnRay,
  extentOf,
  frameOf,
  lineOf,
  scaleBar,
} from "./drawing.mjs";
import { choice, element, fixed, isWide, labelled, length, onResize, shape, widthOf } from "./format.mjs";
import { VIEWS, imagedPoint, isPerspective } from "./optics.mjs";
import { cameraWords, pointInWords, prescription, readings } from "./readings.mjs";
import { change, scenePoint, state, whenChanged } from "./state.mjs";

const TALLEST = 620;

/** A slider over 0..1 with its value in words. */
function slider(label, key, words) {
  const input = element("input", {
    type: "range",
    min: 0,
    max: 1,
    step: 0.001,
    value: state[key],
    id: `slider-${key}`,
    input: () => change({ [key]: Number(input.value) }),
  });
  const shown = element("output", { for: `slider-${key}` });
  const update = () => {
    input.value = state[key];
    shown.textContent = words();
    input.setAttribute("aria-valuetext", shown.textContent);
  };
  return { control: element("label", {}, element("span", {}, `${label}: `, shown), input), update };
}

/** Cross-section, image and scene of one design with the live ray; drawn again whenever asked. */
export function raySection(design, width, tallest = TALLEST, extent = extentOf(design)) {
  const frame = frameOf(extent, width, tallest);
  const live = shape("g", { class: "live" });
  const drawing = shape(
    "svg",
    {
      viewBox: `0 0 ${frame.width} ${frame.height.toFixed(1)}`,
      role: "img",
      "aria-label": `Cross-section of ${design.configuration} with the live ray`,
    },
    shape("g", {}, drawnFans(design, frame, { "stroke-width": 0.8, "stroke-opacity": 0.35 })),
    drawnHardware(design, frame),
    live,
    drawnAxis(design, frame),
    scaleBar(frame),
  );
  const update = (found) => {
    const rays = VIEWS.filter((name) => state.view === "both" || state.view === name)
      .map((name) => [name, found.views[name].ray])
      .filter(([, ray]) => ray !== null);
    const towards = rays.flatMap(([name, ray]) => {
      const turn = Math.sign(ray.direction[0]) || 1;
      const [r, z] = ray.points.at(-1);
      const viewpoint = [0, design.views[name].viewpoint_mm];
      return [
        lineOf(frame, [[turn * r, z], viewpoint], {
          stroke: COLOUR[name],
          "stroke-width": 0.8,
          "stroke-dasharray": "2 3",
        }),
        drawnRay(frame, name, ray, 1, { "stroke-width": 2.2, class: `ray-${name}` }),
        ...ray.points.slice(1).map(([x, y]) => {
          const [cx, cy] = frame.at([turn * x, y]);
          return shape("circle", { cx, cy, r: 3.2, fill: COLOUR[name] });
        }),
      ];
    });
    live.replaceChildren(...towards);
  };
  return { drawing, update };
}

/** The working volume to scale, with the scene point and the lines of sight from both viewpoints. */
function sceneDrawing(design, at, found, width) {
  const [near, far] = design.working_volume.distance_mm;
  const [low, high] = design.working_volume.elevation_deg.map((angle) => Math.tan((angle * Math.PI) / 180));
  const middle = (design.views.upper.viewpoint_mm + design.views.lower.viewpoint_mm) / 2;
  const bottom = middle + Math.min(low * far, -0.08 * far);
  const top = middle + Math.max(high * far, 0.08 * far);
  const scale = Math.min((width - 40) / far, 340 / (top - bottom));
  const height = (top - bottom) * scale + 34;
  const to = ([r, z]) => [20 + r * scale, 12 + (top - z) * scale];
  const path = (points) =>
    points
      .map(
        (point, place) =>
          `${place ? "L" : "M"}${to(point)
            .map((value) => value.toFixed(2))
            .join(" ")}`,
      )
      .join("");
  const corners = [
    [near, low],
    [far, low],
    [far, high],
    [near, high],
  ].map(([r, slope]) => [r, middle + slope * r]);
  const parts = [
    shape("path", { d: `${path(corners)}Z`, fill: "#eef3ee", stroke: "#00795a", "stroke-dasharray": "5 3" }),
    shape("path", {
      d: path([
        [0, bottom],
        [0, top],
      ]),
      stroke: "#6b6b6b",
      "stroke-dasharray": "10 3 2 3",
      "stroke-width": 0.7,
    }),
  ];
  for (const name of VIEWS) {
    if (state.view !== "both" && state.view !== name) continue;
    parts.push(
      shape("path", {
        d: path([[0, design.views[name].viewpoint_mm], found.point]),
        stroke: COLOUR[name],
        "stroke-dasharray": DASH[name],
        "stroke-width": 1.6,
        fill: "none",
      }),
    );
  }
  const [x, y] = to(found.point);
  parts.push(shape("circle", { cx: x, cy: y, r: 4.5, fill: "#1a1a1a" }));
  if (found.depthError !== null) {
    const spread = found.depthError * at.distance;
    const along = [-spread, spread].map((step) =>
      to([at.distance + step, middle + ((found.point[1] - middle) * (at.distance + step)) / at.distance]),
    );
    parts.push(
      shape("path", { d: `M${along[0].join(" ")}L${along[1].join(" ")}`, stroke: "#1a1a1a", "stroke-width": 2 }),
    );
  }
  for (const [value, anchor] of [
    [near, "middle"],
    [far, "end"],
  ]) {
    const [tickX] = to([value, bottom]);
    parts.push(
      shape(
        "text",
        { x: tickX, y: height - 6, "font-size": 12, "text-anchor": anchor },
        length(value).replace(/\.?0+ m$/, " m"),
      ),
    );
  }
  const label = "Working volume with the scene point and the lines of sight of both views";
  return shape("svg", { viewBox: `0 0 ${width} ${height.toFixed(1)}`, role: "img", "aria-label": label }, ...parts);
}

/** Build the section of the live ray. */
export function buildRays(data) {
  const names = Object.keys(data.designs);
  const panels = document.getElementById("ray-panels");
  const controls = document.getElementById("ray-controls");
  if (!names.length) {
    panels.append(
      element("p", { class: "notice" }, "No configuration is feasible, so there is no design to follow a ray through."),
    );
    return;
  }
  const picker = choice(
    names.map((name) => [name, optionText(data, name)]),
    names[0],
    (name) => change({ selected: name }),
  );
  const current = () => data.designs[state.selected] ?? data.designs[picker.value];
  const elevation = slider("Elevation", "elevationShare", () =>
    fixed((scenePoint(current()).elevation * 180) / Math.PI, 2, "°"),
  );
  const distance = slider("Distance", "distanceShare", () => length(scenePoint(current()).distance));
  const views = [
    ["both", "both"],
    ["upper", "upper"],
    ["lower", "lower"],
  ];
  controls.append(
    labelled("Design", picker),
    elevation.control,
    distance.control,
    labelled(
      "View",
      choice(views, state.view, (value) => change({ view: value })),
    ),
  );
  let section = null;
  let places = null;

  function build() {
    const design = current();
    const [left, right] = isWide(panels) ? [0.585, 0.39] : [1, 1];
    const width = Math.round(widthOf(panels) * left);
    const side = Math.round(widthOf(panels) * right);
    section = raySection(design, width);
    places = {
      width,
      side,
      readings: element("div"),
      image: element("div"),
      scene: element("div"),
      caption: element("figcaption"),
    };
    places.picture = element(
      "figure",
      {},
      places.image,
      element("figcaption", {}, "The image: zones of both views and the image points"),
    );
    panels.replaceChildren(
      element(
        "div",
        { class: "panels" },
        element(
          "div",
          {},
          element("figure", {}, section.drawing, places.caption),
          element(
            "figure",
            {},
            places.scene,
            element(
              "figcaption",
              {},
              "The scene, to scale: working volume, lines of sight from both viewpoints, depth error as a bar (±σ)",
            ),
          ),
        ),
        element("div", {}, places.readings, places.picture),
      ),
      element("h3", {}, `Prescription of ${design.configuration}`),
      prescription(design),
      element("p", { class: "note" }, cameraWords(design)),
    );
    update();
  }

  function update() {
    const design = current();
    const at = scenePoint(design);
    const found = imagedPoint(design, at.elevation, at.distance);
    const points = Object.fromEntries(VIEWS.map((name) => [name, found.views[name].pointPx]));
    elevation.update();
    distance.update();
    section.update(found);
    places.readings.replaceChildren(...readings(design, at, found));
    // Where the zones lie in the image is known for one law of the lens only.
    places.picture.hidden = !isPerspective(design.camera);
    places.image.replaceChildren(drawnImage(design, places.side, points));
    places.scene.replaceChildren(sceneDrawing(design, at, found, places.width));
    places.caption.textContent =
      `${design.configuration}, ${pointInWords(at)}. ` +
      "Solid blue the upper view, dashed orange the lower; dotted lines lead to the viewpoints.";
  }

  whenChanged((changed) => {
    if (changed.has("selected") && data.designs[state.selected]) {
      picker.value = state.selected;
      build();
    } else if (section && ["elevationShare", "distanceShare", "view"].some((name) => changed.has(name))) update();
  });
  onResize(panels, build);
}

/** A design's rank and name, for lists. */
export function optionText(data, name) {
  const row = data.rows.find((each) => each.configuration === name);
  return row?.rank ? `${row.rank}  ${name}` : name;
}
