// The optics of one design, as designer/optics and designer/evaluate have them in Python (docs/theory.md, sections 1
// to 5 and 9). tests/report/test_html_optics.py runs both and holds them to 1e-9. Lengths in mm, angles in radians;
// R is the signed distance from the axis, z the height over the pinhole, m = tan(phi) the slope of a ray.

export const VIEWS = ["upper", "lower"];

/** t = tan(pi/4 +- phi/2) from the slope m: + for a direct view, - for a folded one. */
export function halfAngleTangent(slope, sense) {
  return Math.sqrt(1 + slope * slope) + (sense === "direct" ? slope : -slope);
}

/** tan(psi/2) at the pinhole: the gain law. */
export function pinholeTangent(slope, view) {
  return view.gain * halfAngleTangent(slope, view.sense);
}

/** Whether the image radius follows from the angle as r = f tan(psi); this page knows no other law. */
export function isPerspective(camera) {
  const law = camera.projection ?? "perspective";
  return law === "perspective" && !(camera.distortion ?? []).length;
}

/** Signed image radius r = f tan(psi) in mm. */
export function imageRadius(slope, view, focalLength) {
  const half = pinholeTangent(slope, view);
  return (focalLength * 2 * half) / (1 - half * half);
}

/** Signed dr/dphi in mm per radian. */
export function imageRadiusSlope(slope, view, focalLength) {
  const tangent = halfAngleTangent(slope, view.sense);
  const squared = (view.gain * tangent) ** 2;
  const sign = view.sense === "direct" ? 1 : -1;
  return (sign * focalLength * view.gain * (1 + tangent ** 2) * (1 + squared)) / (1 - squared) ** 2;
}

/** Slopes at both viewpoints of a point given by tan(elevation) from the middle of the baseline and by distance. */
export function slopesOfPoint(slope, distance, baseline) {
  const parallax = baseline / (2 * distance);
  return { lower: slope + parallax, upper: slope - parallax };
}

/** Height of a mirror's face over the pinhole at a distance from the axis. */
export function faceHeight(mirror, radius) {
  if (mirror.radius_mm === null) return mirror.vertex_mm;
  const curvature = 1 / mirror.radius_mm;
  const root = Math.sqrt(Math.max(1 - (1 + mirror.conic) * curvature * curvature * radius * radius, 0));
  return mirror.vertex_mm + (curvature * radius * radius) / (1 + root);
}

export function mirrorNamed(design, name) {
  return design.mirrors.find((mirror) => mirror.name === name);
}

/**
 * Follow the ray that a view records at a slope, over the mirrors of the prescription, by intersection and reflection.
 *
 * Returns the points [R, z] from the pinhole to the last mirror, the direction in which the ray leaves, and whether
 * every point lies within its mirror's aperture; null if a mirror is missed. Nothing here knows foci or viewpoints.
 */
export function traceRay(design, view, slope) {
  const half = pinholeTangent(slope, view);
  let direction = [(2 * half) / (1 + half * half), (1 - half * half) / (1 + half * half)];
  const points = [[0, 0]];
  let isInside = true;
  for (const name of view.path) {
    const mirror = mirrorNamed(design, name);
    const met = meet(mirror, points.at(-1), direction);
    if (met === null) return null;
    points.push(met.point);
    direction = met.direction;
    const radius = Math.abs(met.point[0]);
    isInside &&= radius >= mirror.inner_radius_mm - 1e-9 && radius <= mirror.outer_radius_mm + 1e-9;
  }
  return { points, direction, isInside };
}

/** Where a ray meets a conic's vertex sheet on its reflecting side, and the direction after the reflection. */
function meet(mirror, [fromR, fromZ], [alongR, alongZ]) {
  const curvature = mirror.radius_mm === null ? 0 : 1 / mirror.radius_mm;
  const stretch = 1 + mirror.conic;
  const height = fromZ - mirror.vertex_mm;
  const a = curvature * (alongR * alongR + stretch * alongZ * alongZ);
  const b = curvature * (fromR * alongR + stretch * height * alongZ) - alongZ;
  const c = curvature * (fromR * fromR + stretch * height * height) - 2 * height;
  const discriminant = b * b - a * c;
  if (discriminant < 0) return null;
  const q = -(b + (b < 0 ? -1 : 1) * Math.sqrt(discriminant));
  const steps = [q / a, c / q].filter((step) => Number.isFinite(step) && step > 1e-9).sort((x, y) => x - y);
  for (const step of steps) {
    const r = fromR + step * alongR;
    const z = height + step * alongZ;
    // Points from the vertex away from the other sheet, and on a mirror that faces down against the light.
    const normal = [curvature * r, curvature * stretch * z - 1];
    const along = alongR * normal[0] + alongZ * normal[1];
    const isOnVertexSheet = 1 - stretch * curvature * z >= 0;
    if (!isOnVertexSheet || (mirror.faces === "down" ? along >= 0 : along <= 0)) continue;
    const scale = (2 * along) / (normal[0] ** 2 + normal[1] ** 2);
    return {
      point: [r, z + mirror.vertex_mm],
      direction: [alongR - scale * normal[0], alongZ - scale * normal[1]],
    };
  }
  return null;
}

/** Signed diameter in mm of the blur on the sensor of a scene point at a distance from the axis, by closed form. */
export function blurOnSensor(design, view, slope, distance) {
  const camera = design.camera;
  const nearness = camera.focus_distance_mm ? 1 / camera.focus_distance_mm : 0;
  const pupil = camera.focal_length_mm / (1 + camera.focal_length_mm * nearness) / camera.f_number;
  return pupil * camera.focal_length_mm * (nearness - reciprocalImageDepth(design, view, slope, distance));
}

/** 1 / z_V in 1/mm: the nearness, along the axis, of the virtual image of a scene point. */
export function reciprocalImageDepth(design, view, slope, distance) {
  const ray = chiefRay(design, view, slope);
  const nearness = 1 / (distance * Math.sqrt(1 + slope * slope));
  let height = 1 - ray.viewpointDistance * nearness;
  let theta = nearness;
  for (let place = ray.powers.length - 1; place >= 0; place -= 1) {
    theta -= ray.powers[place] * height;
    height += ray.legs[place] * theta;
  }
  const squared = ray.halfTangent * ray.halfTangent;
  return theta / height / ((1 - squared) / (1 + squared));
}

/** A view's chief ray from the foci of its mirrors: points, powers and legs (designer/optics/focus.py). */
export function chiefRay(design, view, slope) {
  const atViewpoint = halfAngleTangent(slope, view.sense);
  const atPinhole = view.gain * atViewpoint;
  const conics = view.path.map((name, place) => {
    const mirror = mirrorNamed(design, name);
    const focus = place ? view.viewpoint_mm : 0;
    const distance = mirror.vertex_mm - focus;
    return { focus, distance, ratio: mirror.radius_mm === null ? 1 : 1 + (2 * distance) / mirror.radius_mm };
  });
  const points = [];
  const powers = [];
  conics.forEach((conic, place) => {
    // A second mirror is written from the viewpoint and faces up.
    const tangent = place ? atViewpoint : atPinhole;
    const squared = tangent * tangent;
    const reach = 1 - conic.ratio * squared;
    points.push([(2 * conic.distance * tangent) / reach, conic.focus + (conic.distance * (1 - squared)) / reach]);
    const spread = (1 + squared) * (1 + conic.ratio * conic.ratio * squared);
    const power = ((1 - conic.ratio) * reach * reach) / (conic.distance * spread);
    powers.push(place ? -power : power);
  });
  const pinholeSquared = atPinhole * atPinhole;
  const start = [(2 * atPinhole) / (1 + pinholeSquared), (1 - pinholeSquared) / (1 + pinholeSquared)];
  const legs = [points[0][0] * start[0] + points[0][1] * start[1]];
  for (let place = 1; place < points.length; place += 1) {
    legs.push(Math.hypot(points[place][0] - points[place - 1][0], points[place][1] - points[place - 1][1]));
  }
  const secant = Math.sqrt(1 + slope * slope);
  const [radius, height] = points.at(-1);
  const viewpointDistance = radius / secant + ((height - view.viewpoint_mm) * slope) / secant;
  return { halfTangent: atPinhole, points, powers, legs, viewpointDistance };
}

/** sigma_D / D of a point by noise and image scale together; noise in mm on the sensor for each view. */
export function relativeDepthError(design, slope, distance, noise) {
  const slopes = slopesOfPoint(slope, distance, design.baseline_mm);
  const focal = design.camera.focal_length_mm;
  const perDisparity = 1 / (slopes.lower - slopes.upper);
  const errors = VIEWS.map((name) => {
    const m = slopes[name];
    return (noise[name] * (1 + m * m)) / imageRadiusSlope(m, design.views[name], focal);
  });
  const byNoise = perDisparity * Math.sqrt(errors[0] ** 2 + errors[1] ** 2);
  const byScale = (design.scale_uncertainty ?? 0) * depthShiftPerScale(design, slopes);
  return Math.sqrt(byNoise ** 2 + byScale ** 2);
}

/** Relative depth errors up to which first order, and first and second order together, hold to two percent. */
export const FIRST_ORDER_BOUND = 0.065;
export const SECOND_ORDER_BOUND = 0.149;

/** Root mean square relative depth error to second order where first order says s. */
export function secondOrder(s) {
  return s * Math.sqrt(1 + 9 * s * s);
}

/** Relative depth shift of a point per relative error of the image's scale. */
export function depthShiftPerScale(design, slopes) {
  const shift = (name) => {
    const view = design.views[name];
    const squared = pinholeTangent(slopes[name], view) ** 2;
    const sign = view.sense === "direct" ? 1 : -1;
    return (sign * Math.sqrt(1 + slopes[name] ** 2) * (1 - squared)) / (1 + squared);
  };
  return (shift("upper") - shift("lower")) / (slopes.lower - slopes.upper);
}

/**
 * The noise of an image point in both views, mm on the sensor, at an elevation from the middle and a distance.
 *
 * The same everywhere, or interpolated in a table that Python wrote: evenly spaced in elevation and in the logarithm
 * of the distance.
 */
export function noiseAt(design, elevation, distance) {
  const pitch = design.camera.pixel_pitch_mm;
  const table = design.noise_table;
  if (!table) return { upper: design.noise_px * pitch, lower: design.noise_px * pitch };
  const [low, high] = design.working_volume.elevation_deg;
  const [near, far] = design.working_volume.distance_mm;
  const across = ((elevation * 180) / Math.PI - low) / (high - low);
  const along = Math.log(distance / near) / Math.log(far / near);
  return {
    upper: pitch * interpolated(table.upper_px, across, along),
    lower: pitch * interpolated(table.lower_px, across, along),
  };
}

/** Cubic interpolation (Catmull and Rom) of a table of rows at shares 0..1 across its rows and along its columns. */
function interpolated(rows, across, along) {
  const [row, rowWeights] = cubicWeights(across, rows.length);
  const [column, columnWeights] = cubicWeights(along, rows[0].length);
  let total = 0;
  for (let i = 0; i < 4; i += 1) {
    for (let j = 0; j < 4; j += 1) {
      total += rowWeights[i] * columnWeights[j] * padded(rows, row + i - 1, column + j - 1);
    }
  }
  return total;
}

function cubicWeights(share, count) {
  const position = Math.min(Math.max(share, 0), 1) * (count - 1);
  const place = Math.min(Math.floor(position), count - 2);
  const x = position - place;
  return [
    place,
    [
      ((-x + 2) * x - 1) * x * 0.5,
      ((3 * x - 5) * x * x + 2) * 0.5,
      ((-3 * x + 4) * x + 1) * x * 0.5,
      (x - 1) * x * x * 0.5,
    ],
  ];
}

/** An entry of a table, continued straight beyond its edges by one place. */
function padded(rows, row, column) {
  if (row < 0) return 2 * padded(rows, 0, column) - padded(rows, 1, column);
  if (row >= rows.length) return 2 * padded(rows, rows.length - 1, column) - padded(rows, rows.length - 2, column);
  const values = rows[row];
  if (column < 0) return 2 * values[0] - values[1];
  if (column >= values.length) return 2 * values.at(-1) - values.at(-2);
  return values[column];
}

/** Everything that the page says of one scene point in one design. */
export function imagedPoint(design, elevation, distance) {
  const slope = Math.tan(elevation);
  const slopes = slopesOfPoint(slope, distance, design.baseline_mm);
  const camera = design.camera;
  const pitch = camera.pixel_pitch_mm;
  const middle = (design.views.upper.viewpoint_mm + design.views.lower.viewpoint_mm) / 2;
  const known = isPerspective(camera);
  const noise = noiseAt(design, elevation, distance);
  const views = {};
  for (const name of VIEWS) {
    const view = design.views[name];
    const radius = imageRadius(slopes[name], view, camera.focal_length_mm) / pitch;
    const blur = view.path.length > 2 ? null : Math.abs(blurOnSensor(design, view, slopes[name], distance));
    const perRadian = Math.abs(imageRadiusSlope(slopes[name], view, camera.focal_length_mm));
    views[name] = {
      slope: slopes[name],
      elevation: Math.atan(slopes[name]),
      ray: traceRay(design, view, slopes[name]),
      radiusPx: known ? radius : null,
      pointPx: known ? [(camera.width_px - 1) / 2 + radius, (camera.height_px - 1) / 2] : null,
      blurPx: known && blur !== null ? blur / pitch : null,
      blurDeg: known && blur !== null ? ((blur / perRadian) * 180) / Math.PI : null,
      noisePx: noise[name] / pitch,
    };
  }
  return {
    point: [distance, middle + distance * slope],
    depthError: known ? relativeDepthError(design, slope, distance, noise) : null,
    views,
  };
}
