// What three.js draws of a design: cut-open solids of revolution, rays and working volume. In three.js y is up: the
// rig's z.

import { COLOUR, backOffset, faceProfile } from "./drawing.mjs";
import { VIEWS, imagedPoint, traceRay } from "./optics.mjs";
import { scenePoint, state } from "./state.mjs";

const AROUND = 72;
const FAN_AZIMUTHS = 6;
const TURN = 2 * Math.PI;
// How far each part moves from the next at most, over the height of the whole.
export const EXPLOSION = 0.4;
const CUT_COLOUR = 0xe0b050;

/** Lowest and highest point of mirrors and lens, mm. */
export function heightsOf(design) {
  const heights = design.mirrors.flatMap((mirror) => {
    const profile = faceProfile(mirror, 1, 8).map(([, height]) => height);
    return [...profile, ...profile.map((height) => height + backOffset(mirror))];
  });
  return [Math.min(...heights, design.camera.lens_front_mm), Math.max(...heights)];
}

/** Mirrors, lens and body, cut open. */
export function solidsOf(design, shown, planes, three) {
  const group = new three.Group();
  const [low, high] = heightsOf(design);
  const wedge = (shown.open * Math.PI) / 180;
  // The cut faces the camera, about the azimuth of +z.
  const from = Math.PI / 2 + wedge / 2;
  const sweep = TURN - wedge;
  const add = (geometry, colour, lift = 0) => {
    const material = new three.MeshStandardMaterial({
      color: colour,
      metalness: 0.15,
      roughness: 0.45,
      side: three.DoubleSide,
      clippingPlanes: planes,
    });
    const mesh = new three.Mesh(geometry, material);
    mesh.position.y = lift;
    group.add(mesh);
  };
  const order = [...design.mirrors].sort((one, other) => one.vertex_mm - other.vertex_mm).map((mirror) => mirror.name);
  // Exploded, all parts keep their order and their middle: the camera is the lowest.
  const liftOf = (place) => shown.explode * EXPLOSION * (high - low) * (place - order.length / 2);
  for (const mirror of design.mirrors) {
    const face = faceProfile(mirror, 1);
    const back = face.map(([r, z]) => [r, z + backOffset(mirror)]);
    const lift = liftOf(order.indexOf(mirror.name) + 1);
    add(revolved({ face, back }, from, sweep, three), 0xb9c4d0, lift);
    if (wedge > 0) add(cutFaces({ face, back }, [from, from + sweep], three), CUT_COLOUR, lift);
  }
  const { camera } = design;
  const seat = camera.lens_front_mm - camera.lens_length_mm;
  const bottom = seat - 0.25 * (high - low);
  const cylinder = (radius, floor, top) =>
    revolved(
      {
        face: [
          [0, top],
          [radius, top],
        ],
        back: [
          [0, floor],
          [radius, floor],
        ],
      },
      0,
      TURN,
      three,
    );
  if (seat < camera.lens_front_mm)
    add(cylinder(camera.lens_radius_mm, seat, camera.lens_front_mm), 0x4a4a4a, liftOf(0));
  if (camera.body_radius_mm > 0) add(cylinder(camera.body_radius_mm, bottom, seat), 0x6e6e6e, liftOf(0));
  return group;
}

/** Rays of both views, the live ray with its scene point, and the working volume. */
export function linesOf(design, shown, three) {
  const group = new three.Group();
  const [low, high] = heightsOf(design);
  const lines = (points, colour, opacity) => {
    const geometry = new three.BufferGeometry();
    geometry.setAttribute("position", new three.Float32BufferAttribute(points.flat(), 3));
    group.add(
      new three.LineSegments(geometry, new three.LineBasicMaterial({ color: colour, transparent: true, opacity })),
    );
  };
  if (shown.rays && shown.explode === 0) {
    const reach = 1.1 * Math.max(high - low, design.diameter_mm);
    for (const name of VIEWS.filter((each) => state.view === "both" || state.view === each)) {
      lines(fanPoints(design, name, reach), COLOUR[name], 0.45);
    }
    const at = scenePoint(design);
    const found = imagedPoint(design, at.elevation, at.distance);
    for (const name of VIEWS.filter((each) => state.view === "both" || state.view === each)) {
      const { ray } = found.views[name];
      if (ray) lines(segments([...flipped(ray), found.point], 0), COLOUR[name], 1);
    }
    const dot = new three.Mesh(
      new three.SphereGeometry(0.012 * at.distance, 16, 12),
      new three.MeshBasicMaterial({ color: 0x1a1a1a }),
    );
    dot.position.set(found.point[0], found.point[1], 0);
    group.add(dot);
  }
  lines(volumePoints(design), 0x00795a, 0.8);
  return group;
}

/** A ray's points turned so that it leaves towards positive R. */
function flipped(ray) {
  const turn = Math.sign(ray.direction[0]) || 1;
  return ray.points.map(([r, z]) => [turn * r, z]);
}

/** Successive points [R, z] as segments in space at an azimuth. */
function segments(points, azimuth) {
  const placed = points.map(([r, z]) => [r * Math.cos(azimuth), z, r * Math.sin(azimuth)]);
  return placed.slice(1).flatMap((point, place) => [placed[place], point]);
}

function fanPoints(design, name, reach) {
  const view = design.views[name];
  const found = [];
  for (const angle of view.elevation_deg) {
    const ray = traceRay(design, view, Math.tan((angle * Math.PI) / 180));
    if (!ray) continue;
    const [r, z] = ray.points.at(-1);
    const end = [r + reach * ray.direction[0], z + reach * ray.direction[1]];
    for (let place = 0; place < FAN_AZIMUTHS; place += 1) {
      found.push(...segments([...ray.points, end], (TURN * place) / FAN_AZIMUTHS));
    }
  }
  return found;
}

/** The edges of the working volume: its four rings, and four sections. */
function volumePoints(design) {
  const middle = (design.views.upper.viewpoint_mm + design.views.lower.viewpoint_mm) / 2;
  const slopes = design.working_volume.elevation_deg.map((angle) => Math.tan((angle * Math.PI) / 180));
  const [near, far] = design.working_volume.distance_mm;
  const corners = [
    [near, slopes[0]],
    [far, slopes[0]],
    [far, slopes[1]],
    [near, slopes[1]],
  ].map(([r, slope]) => [r, middle + slope * r]);
  const found = [];
  for (const [r, z] of corners) {
    for (let place = 0; place < AROUND; place += 1) {
      for (const step of [place, place + 1]) {
        const azimuth = (TURN * step) / AROUND;
        found.push([r * Math.cos(azimuth), z, r * Math.sin(azimuth)]);
      }
    }
  }
  for (let place = 0; place < 4; place += 1) found.push(...segments([...corners, corners[0]], (TURN * place) / 4));
  return found;
}

/** The surface of a solid of revolution between a face and its back, over an arc. */
function revolved({ face, back }, from, sweep, three) {
  const positions = [];
  const indices = [];
  const steps = Math.max(2, Math.round((AROUND * sweep) / TURN));
  // Strips of their own, so that edges stay sharp.
  for (const profile of [face, back, [face[0], back[0]], [face.at(-1), back.at(-1)]]) {
    const first = positions.length / 3;
    for (let place = 0; place <= steps; place += 1) {
      const azimuth = from + (sweep * place) / steps;
      for (const [r, z] of profile) positions.push(r * Math.cos(azimuth), z, r * Math.sin(azimuth));
    }
    for (let place = 0; place < steps; place += 1) {
      for (let along = 0; along + 1 < profile.length; along += 1) {
        const a = first + place * profile.length + along;
        const b = a + profile.length;
        indices.push(a, b, a + 1, b, b + 1, a + 1);
      }
    }
  }
  return geometryOf(positions, indices, three);
}

/** The two faces at which a solid of revolution is cut open. */
function cutFaces({ face, back }, azimuths, three) {
  const positions = [];
  const indices = [];
  for (const azimuth of azimuths) {
    const first = positions.length / 3;
    face.forEach((point, place) => {
      for (const [r, z] of [point, back[place]]) positions.push(r * Math.cos(azimuth), z, r * Math.sin(azimuth));
    });
    for (let place = 0; place + 1 < face.length; place += 1) {
      const a = first + 2 * place;
      indices.push(a, a + 1, a + 2, a + 1, a + 3, a + 2);
    }
  }
  return geometryOf(positions, indices, three);
}

function geometryOf(positions, indices, three) {
  const geometry = new three.BufferGeometry();
  geometry.setAttribute("position", new three.Float32BufferAttribute(positions, 3));
  geometry.setIndex(indices);
  geometry.computeVertexNormals();
  return geometry;
}
