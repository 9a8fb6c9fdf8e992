// Cross-sections in the meridional plane, drawn from the prescription.

import { fixed, shape } from "./format.mjs";
import { VIEWS, faceHeight, imageRadius, traceRay } from "./optics.mjs";

export const COLOUR = { upper: "#0072b2", lower: "#d55e00" };
export const DASH = { upper: null, lower: "7 3" };
const SAMPLES = 40;

/** Points [R, z] of a mirror's face from inner to outer rim, on one side of the axis. */
export function faceProfile(mirror, side, samples = SAMPLES) {
  const points = [];
  for (let place = 0; place <= samples; place += 1) {
    const share = place / samples;
    const radius = mirror.inner_radius_mm + share * (mirror.outer_radius_mm - mirror.inner_radius_mm);
    points.push([side * radius, faceHeight(mirror, radius)]);
  }
  return points;
}

/** From a mirror's face to its back along z. */
export function backOffset(mirror) {
  return mirror.faces === "down" ? mirror.thickness_mm : -mirror.thickness_mm;
}

/** What has to fit into a drawing of a design: half-width, lowest and highest point, mm. */
export function extentOf(design) {
  const heights = [0, ...VIEWS.map((name) => design.views[name].viewpoint_mm)];
  let radius = design.camera.lens_radius_mm;
  for (const mirror of design.mirrors) {
    radius = Math.max(radius, mirror.outer_radius_mm);
    for (const [, height] of faceProfile(mirror, 1, 8)) heights.push(height, height + backOffset(mirror));
  }
  const low = Math.min(...heights, design.camera.lens_front_mm);
  const high = Math.max(...heights);
  const camera = Math.max(design.camera.lens_front_mm - design.camera.lens_length_mm, low - 0.25 * (high - low));
  return { radius: Math.max(radius, 0.3 * (high - low)), low: Math.min(low, camera), high };
}

/** A frame on paper for an extent: from (R, z) in mm to (x, y) in pixels. */
export function frameOf(extent, width, tallest, margin = 1.5) {
  const halfWidth = margin * extent.radius;
  const room = 0.08 * (extent.high - extent.low);
  const low = extent.low - room;
  const high = extent.high + room;
  const scale = Math.min(width / (2 * halfWidth), tallest / (high - low));
  return {
    width,
    height: scale * (high - low),
    scale,
    low,
    high,
    reach: width / (2 * scale),
    at: ([r, z]) => [width / 2 + scale * r, scale * (high - z)],
  };
}

/** A path through points in mm. */
export function lineOf(frame, points, attributes, closed = false) {
  const steps = points.map((point, place) => {
    const [x, y] = frame.at(point);
    return `${place ? "L" : "M"}${x.toFixed(2)} ${y.toFixed(2)}`;
  });
  return shape("path", { d: steps.join("") + (closed ? "Z" : ""), fill: "none", ...attributes });
}

/** Mirrors, lens and camera body, without rays. */
export function drawnHardware(design, frame, fine = true) {
  const parts = [];
  const { camera } = design;
  const seat = camera.lens_front_mm - camera.lens_length_mm;
  const box = (radius, low, high, fill) => {
    if (high <= frame.low) return;
    const bottom = Math.max(low, frame.low - 1);
    const corners = [
      [-radius, bottom],
      [-radius, high],
      [radius, high],
      [radius, bottom],
    ];
    parts.push(lineOf(frame, corners, { fill, stroke: "#6b6b6b", "stroke-width": fine ? 1 : 0.6 }));
  };
  box(camera.body_radius_mm, frame.low - 1, seat, "#dddddd");
  box(camera.lens_radius_mm, seat, camera.lens_front_mm, "#ececec");
  for (const mirror of design.mirrors) {
    for (const side of [-1, 1]) {
      const face = faceProfile(mirror, side, fine ? SAMPLES : 12);
      const back = face.map(([r, z]) => [r, z + backOffset(mirror)]).reverse();
      parts.push(lineOf(frame, [...face, ...back], { fill: "#c9c9c9", stroke: "#8a8a8a", "stroke-width": 0.5 }, true));
      parts.push(lineOf(frame, face, { stroke: "#1a1a1a", "stroke-width": fine ? 2.2 : 1.2 }));
    }
  }
  return shape("g", {}, ...parts);
}

/** Follow a traced ray to the edge of the drawing. */
export function raysEnd(frame, ray) {
  const [r, z] = ray.points.at(-1);
  const [alongR, alongZ] = ray.direction;
  const steps = [
    alongR > 0 ? (frame.reach - r) / alongR : alongR < 0 ? (-frame.reach - r) / alongR : Infinity,
    alongZ > 0 ? (frame.high - z) / alongZ : alongZ < 0 ? (frame.low - z) / alongZ : Infinity,
  ];
  const step = Math.max(Math.min(...steps), 0);
  return [r + step * alongR, z + step * alongZ];
}

/** One ray as a path, mirrored to the side of the axis on which it should leave. */
export function drawnRay(frame, name, ray, side, attributes = {}) {
  const turn = side * (Math.sign(ray.direction[0]) || 1);
  const points = [...ray.points, raysEnd(frame, ray)].map(([r, z]) => [turn * r, z]);
  return lineOf(frame, points, { stroke: COLOUR[name], "stroke-dasharray": DASH[name], ...attributes });
}

/** The rays at the ends of each view's elevations: the upper view's on the right, the lower view's on the left. */
export function drawnFans(design, frame, attributes) {
  const parts = [];
  for (const name of VIEWS) {
    const view = design.views[name];
    for (const elevation of view.elevation_deg) {
      const ray = traceRay(design, view, Math.tan((elevation * Math.PI) / 180));
      if (ray) parts.push(drawnRay(frame, name, ray, name === "upper" ? 1 : -1, attributes));
    }
  }
  return shape("g", {}, ...parts);
}

/** A small drawing for the table. */
export function thumbnail(design) {
  const frame = frameOf(extentOf(design), 152, 116, 1.35);
  return shape(
    "svg",
    { viewBox: `0 0 152 ${Math.max(frame.height, 116).toFixed(1)}`, "aria-hidden": "true" },
    drawnHardware(design, frame, false),
    drawnFans(design, frame, { "stroke-width": 1.1 }),
  );
}

/** The axis, the pinhole and both viewpoints. */
export function drawnAxis(design, frame) {
  const parts = [
    lineOf(
      frame,
      [
        [0, frame.low],
        [0, frame.high],
      ],
      { stroke: "#6b6b6b", "stroke-width": 0.7, "stroke-dasharray": "10 3 2 3" },
    ),
  ];
  const [x, y] = frame.at([0, 0]);
  parts.push(
    shape("path", { d: `M${x - 4} ${y - 4}l8 8M${x - 4} ${y + 4}l8 -8`, stroke: "#1a1a1a", "stroke-width": 1.4 }),
  );
  for (const name of VIEWS) {
    const [atX, atY] = frame.at([0, design.views[name].viewpoint_mm]);
    const up = name === "upper" ? -1 : 1;
    const corners = `${atX - 5},${atY - up * 4} ${atX + 5},${atY - up * 4} ${atX},${atY + up * 6}`;
    parts.push(shape("polygon", { points: corners, fill: COLOUR[name] }));
    // In the margin, with a line that leads there: on the axis are mirrors.
    parts.push(
      shape("path", {
        d: `M6 ${atY}H${atX - 7}`,
        stroke: COLOUR[name],
        "stroke-width": 0.6,
        "stroke-dasharray": "1 4",
      }),
    );
    parts.push(shape("text", { x: 6, y: atY - 4, "font-size": 12, class: "halo" }, `${name} viewpoint`));
  }
  return shape("g", {}, ...parts);
}

/** A bar that shows the scale. */
export function scaleBar(frame) {
  const wanted = frame.reach / 2.5;
  const power = 10 ** Math.floor(Math.log10(wanted));
  const bar = [5, 2, 1].map((digit) => digit * power).find((size) => size <= wanted);
  const y = frame.height - 12;
  const end = 12 + bar * frame.scale;
  return shape(
    "g",
    { stroke: "#1a1a1a", "stroke-width": 1.2 },
    shape("path", { d: `M12 ${y - 4}v8M12 ${y}H${end}M${end} ${y - 4}v8`, fill: "none" }),
    shape("text", { x: end + 6, y: y + 4, "font-size": 12, stroke: "none" }, `${fixed(bar, bar < 1 ? 1 : 0)} mm`),
  );
}

/** The image with the zones of both views and, if given, the image points. */
export function drawnImage(design, width, points = null) {
  const { camera } = design;
  const scale = width / camera.width_px;
  const height = camera.height_px * scale;
  const parts = [
    shape("rect", { x: 0.5, y: 0.5, width: width - 1, height: height - 1, fill: "#fafafa", stroke: "#8a8a8a" }),
  ];
  const centre = [width / 2, height / 2];
  for (const name of VIEWS) {
    const view = design.views[name];
    const [inner, outer] = view.elevation_deg
      .map((angle) => Math.abs(imageRadius(Math.tan((angle * Math.PI) / 180), view, camera.focal_length_mm)))
      .map((radius) => (radius / camera.pixel_pitch_mm) * scale)
      .sort((a, b) => a - b);
    parts.push(
      shape("circle", {
        cx: centre[0],
        cy: centre[1],
        r: (inner + outer) / 2,
        fill: "none",
        stroke: COLOUR[name],
        "stroke-opacity": 0.22,
        "stroke-width": outer - inner,
      }),
    );
    for (const radius of [inner, outer]) {
      parts.push(
        shape("circle", {
          cx: centre[0],
          cy: centre[1],
          r: radius,
          fill: "none",
          stroke: COLOUR[name],
          "stroke-dasharray": DASH[name],
        }),
      );
    }
  }
  for (const name of VIEWS) {
    const at = points?.[name];
    if (!at) continue;
    const [x, y] = at.map((value) => (value + 0.5) * scale);
    parts.push(shape("circle", { cx: x, cy: y, r: 5, fill: COLOUR[name], stroke: "#fff", "stroke-width": 1.5 }));
    parts.push(
      shape(
        "text",
        { x, y: y + (name === "upper" ? -10 : 20), "font-size": 12, "text-anchor": "middle", class: "halo" },
        name,
      ),
    );
  }
  return shape(
    "svg",
    { viewBox: `0 0 ${width} ${height.toFixed(1)}`, role: "img", "aria-label": "Image with the zones of both views" },
    ...parts,
  );
}
