// What a scene point gives in a design, and the prescription, as tables.

import { element, fixed, length, significant } from "./format.mjs";
import { FIRST_ORDER_BOUND, SECOND_ORDER_BOUND, VIEWS, secondOrder } from "./optics.mjs";

export const OTHER_LAW =
  "The lens follows another law than r = f tan ψ, which this page does not know: " +
  "the paths are exact, but there is no image point, blur or depth error.";

/** Elevation and distance of the scene point in words. */
export function pointInWords(at) {
  return `elevation ${fixed((at.elevation * 180) / Math.PI, 2)}°, distance ${length(at.distance)}`;
}

/** What to think of a depth error that first order does not tell truly; nothing of a small one. */
function orderInWords(error) {
  if (error <= FIRST_ORDER_BOUND) return "";
  if (error > SECOND_ORDER_BOUND) return "; too large for first and second order, so more than this";
  return `; first order, to second order ${fixed(100 * secondOrder(error), 3)} %`;
}

/** What the depth error at a point counts. */
export function countedInWords(design) {
  const noise = design.noise_table
    ? "the noise predicted at this point in each view (designer evaluate counts the same noise everywhere, " +
      `${significant(design.noise_px)} px)`
    : `${significant(design.noise_px)} px of noise in each view, the same everywhere`;
  const scale = design.scale_uncertainty
    ? `a scale of the image known to ${significant(100 * design.scale_uncertainty)} %, added in quadrature`
    : "no uncertainty of the scale";
  return `It counts ${noise}, and ${scale}.`;
}

/** A table of what both views record of the scene point. */
export function readings(design, at, found) {
  const rows = [
    ["elevation at the viewpoint", (view) => fixed((view.elevation * 180) / Math.PI, 3, "°")],
    ["image radius", (view) => fixed(view.radiusPx, 2, "px")],
    [
      "image point u, v (azimuth 0)",
      (view) => (view.pointPx ? view.pointPx.map((value) => fixed(value, 2)).join(", ") : "–"),
    ],
    ["blur on the sensor", (view) => fixed(view.blurPx, 2, "px")],
    ["blur in the scene", (view) => fixed(view.blurDeg, 3, "°")],
    [
      design.noise_table ? "noise of a match, predicted" : "noise of a match, constant",
      (view) => fixed(view.noisePx, 3, "px"),
    ],
    [
      "within the clear apertures",
      (view) => (view.ray === null ? "misses a mirror" : view.ray.isInside ? "yes" : "no"),
    ],
  ];
  const heads = VIEWS.map((name) => element("th", { scope: "col", class: `number ${name}` }, `${name} view`));
  const depth =
    found.depthError === null
      ? element("p", { class: "notice" }, OTHER_LAW)
      : element(
          "p",
          { class: "reading" },
          "Depth error here: ",
          element("strong", {}, `${fixed(100 * found.depthError, 3)} %`),
          ` = ${significant(found.depthError * at.distance)} mm (one standard deviation)${orderInWords(found.depthError)}. ${countedInWords(design)}`,
        );
  return [
    depth,
    element(
      "table",
      {},
      element("thead", {}, element("tr", {}, element("th", { scope: "col" }, ""), ...heads)),
      element(
        "tbody",
        {},
        ...rows.map(([label, value]) =>
          element(
            "tr",
            {},
            element("th", { scope: "row" }, label),
            ...VIEWS.map((name) => element("td", { class: "number" }, value(found.views[name]))),
          ),
        ),
      ),
    ),
  ];
}

/** The mirrors as opticians write them. */
export function prescription(design) {
  const heads = [
    "mirror",
    "kind",
    "faces",
    "vertex z₀ (mm)",
    "radius r₀ (mm)",
    "conic K",
    "inner R (mm)",
    "outer R (mm)",
    "sag (mm)",
    "thickness (mm)",
    "mass (g)",
  ];
  const line = (mirror, place) => [
    `${place + 1} ${mirror.name}`,
    mirror.kind,
    mirror.faces,
    fixed(mirror.vertex_mm, 4),
    mirror.radius_mm === null ? "∞" : fixed(mirror.radius_mm, 4),
    fixed(mirror.conic, 6),
    fixed(mirror.inner_radius_mm, 3),
    fixed(mirror.outer_radius_mm, 3),
    fixed(mirror.sag_mm, 4),
    fixed(mirror.thickness_mm, 2),
    fixed(mirror.mass_g, 1),
  ];
  const style = (column) => (column > 2 ? "number" : null);
  const cell = (text, column) =>
    column ? element("td", { class: style(column) }, text) : element("th", { scope: "row" }, text);
  return element(
    "div",
    { class: "scroll", tabindex: "0", role: "region", "aria-label": "Prescription" },
    element(
      "table",
      { class: "prescription" },
      element(
        "thead",
        {},
        element("tr", {}, ...heads.map((text, column) => element("th", { scope: "col", class: style(column) }, text))),
      ),
      element(
        "tbody",
        {},
        ...design.mirrors.map((mirror, place) => element("tr", {}, ...line(mirror, place).map(cell))),
      ),
    ),
  );
}

/** Camera and views of a design in one line each. */
export function cameraWords(design) {
  const { camera, views } = design;
  const focus = camera.focus_distance_mm ? `${fixed(camera.focus_distance_mm, 1)} mm` : "infinity";
  const words = VIEWS.map((name) => {
    const view = views[name];
    const numbers = `viewpoint ${fixed(view.viewpoint_mm, 3)} mm, gain ${fixed(view.gain, 6)}`;
    return `${name} view: ${numbers}, ${view.sense}, ${view.zone} zone`;
  });
  return [
    `principal distance ${fixed(camera.focal_length_mm, 4)} mm, f/${fixed(camera.f_number, 2)}, focused at ${focus}, ` +
      `${camera.width_px} × ${camera.height_px} px of ${fixed(1000 * camera.pixel_pitch_mm, 2)} µm`,
    ...words,
  ].join("; ");
}
