// The selected design in 3-D: mirrors as cut-open solids, rays of both views, working volume. Drawn by three.js, which
// is read when the section comes into sight; without WebGL a line says so. In three.js y is up: the rig's z.

import { COLOUR, backOffset, faceProfile } from "./drawing.mjs";
import { choice, element, labelled } from "./format.mjs";
import { VIEWS, imagedPoint, traceRay } from "./optics.mjs";
import { optionText } from "./rays.mjs";
import { change, scenePoint, state, whenChanged } from "./state.mjs";

const NO_WEBGL =
  "This browser offers no WebGL, so the rig cannot be drawn in 3-D. Everything else on this page works without it.";
const AROUND = 72;
const FAN_AZIMUTHS = 6;
const TURN = 2 * Math.PI;
const CUT_COLOUR = 0xe0b050;

/** Build the section; nothing is drawn before it comes into sight. */
export function buildRig(data) {
  const view = document.getElementById("rig-view");
  const names = Object.keys(data.designs);
  if (!names.length) {
    view.append(element("p", { class: "notice" }, "No configuration is feasible, so there is no rig to draw."));
    return;
  }
  const watcher = new IntersectionObserver(
    (entries) => {
      if (!entries.some((entry) => entry.isIntersecting)) return;
      watcher.disconnect();
      open(data, names, view);
    },
    { rootMargin: "200px" },
  );
  watcher.observe(view);
}

function open(data, names, view) {
  if (!document.createElement("canvas").getContext("webgl2")) {
    view.append(element("p", { class: "notice", id: "no-webgl" }, NO_WEBGL));
    return;
  }
  const script = document.createElement("script");
  script.textContent = document.getElementById("three").textContent;
  document.head.append(script);
  let stage = null;
  try {
    stage = stageIn(view, globalThis.THREE);
  } catch {
    view.replaceChildren(element("p", { class: "notice", id: "no-webgl" }, NO_WEBGL));
    return;
  }
  document.getElementById("rig").classList.add("drawn");
  const shown = { open: 110, section: "none", place: 0.5, explode: 0, rays: true };
  const current = () => data.designs[state.selected] ?? data.designs[names[0]];
  const build = (aims) => stage.show(current(), shown, aims);
  const set = (values) => {
    Object.assign(shown, values);
    build(false);
  };
  const range = (label, key, most) => {
    const input = element("input", {
      type: "range",
      min: 0,
      max: most,
      step: "any",
      value: shown[key],
      input: () => set({ [key]: Number(input.value) }),
    });
    return labelled(label, input);
  };
  const picker = choice(
    names.map((name) => [name, optionText(data, name)]),
    current().configuration,
    (name) => change({ selected: name }),
  );
  const rays = element("input", { type: "checkbox", checked: true, change: () => set({ rays: rays.checked }) });
  const sections = [
    ["none", "none"],
    ["upright", "upright"],
    ["level", "level"],
  ];
  const button = (text, action) => element("button", { type: "button", click: action }, text);
  document.getElementById("rig-controls").append(
    labelled("Design", picker),
    range("Cut open", "open", 300),
    labelled(
      "Section plane",
      choice(sections, "none", (value) => set({ section: value })),
    ),
    range("Place of the plane", "place", 1),
    range("Explode", "explode", 1),
    element("label", { class: "check" }, rays, "rays"),
    button("Rig", () => stage.aim(current(), "rig")),
    button("From above", () => stage.aim(current(), "above")),
    button("Working volume", () => stage.aim(current(), "volume")),
  );
  view.append(
    element(
      "p",
      { class: "hint" },
      "Drag to turn, scroll or pinch to zoom; with the keyboard: arrow keys turn, + and − zoom. Blue: upper view; orange: lower view; green: working volume; black: the scene point of the live ray.",
    ),
  );
  whenChanged((changed) => {
    if (changed.has("selected") && data.designs[state.selected]) {
      picker.value = state.selected;
      build(true);
    } else if (["elevationShare", "distanceShare", "view"].some((name) => changed.has(name)))
      stage.showRays(current(), shown);
  });
  build(true);
}

/** A canvas with camera, lights and controls; draws when something has changed, and only then. */
function stageIn(view, three) {
  const canvas = element("canvas", { tabindex: "0", "aria-label": "The rig in 3-D", role: "img" });
  const frame = element("div", { class: "canvas" }, canvas);
  // Kept, so that the last picture is printed.
  const renderer = new three.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
  view.append(frame);
  renderer.setClearColor(0xffffff);
  renderer.localClippingEnabled = true;
  const scene = new three.Scene();
  scene.add(new three.HemisphereLight(0xffffff, 0x9a9a9a, 2.2));
  const sun = new three.DirectionalLight(0xffffff, 1.6);
  scene.add(sun);
  const camera = new three.PerspectiveCamera(32, 1, 1, 1e6);
  const controls = new three.OrbitControls(camera, canvas);
  const plane = new three.Plane(new three.Vector3(0, 0, -1), 0);
  let solids = new three.Group();
  let lines = new three.Group();
  scene.add(solids, lines);
  let isAsked = false;

  // Once for each frame, however often something has changed.
  function render() {
    if (isAsked) return;
    isAsked = true;
    requestAnimationFrame(draw);
  }
  function draw() {
    isAsked = false;
    sun.position.copy(camera.position).add(new three.Vector3(0, camera.position.length() * 0.4, 0));
    renderer.render(scene, camera);
  }
  function fit() {
    const { clientWidth, clientHeight } = frame;
    if (!clientWidth) return;
    renderer.setPixelRatio(Math.min(devicePixelRatio || 1, 2));
    renderer.setSize(clientWidth, clientHeight, false);
    camera.aspect = clientWidth / clientHeight;
    camera.updateProjectionMatrix();
    render();
  }
  function turn(azimuth, polar, zoom) {
    const offset = camera.position.clone().sub(controls.target);
    const radius = offset.length() * zoom;
    const around = Math.atan2(offset.x, offset.z) + azimuth;
    const down = Math.min(Math.max(Math.acos(offset.y / offset.length()) + polar, 0.02), Math.PI - 0.02);
    offset
      .set(Math.sin(down) * Math.sin(around), Math.cos(down), Math.sin(down) * Math.cos(around))
      .multiplyScalar(radius);
    camera.position.copy(controls.target).add(offset);
    controls.update();
    render();
  }
  const keys = {
    ArrowLeft: [-0.12, 0, 1],
    ArrowRight: [0.12, 0, 1],
    ArrowUp: [0, -0.1, 1],
    ArrowDown: [0, 0.1, 1],
    "+": [0, 0, 0.87],
    "=": [0, 0, 0.87],
    "-": [0, 0, 1.15],
  };
  canvas.addEventListener("keydown", (event) => {
    if (!(event.key in keys)) return;
    event.preventDefault();
    turn(...keys[event.key]);
  });
  controls.addEventListener("change", render);
  addEventListener("resize", fit);

  function aim(design, what) {
    const [low, high] = heightsOf(design);
    const middle = (low + high) / 2;
    const size = Math.max(high - low, design.diameter_mm);
    const reach = what === "volume" ? 3.2 * design.working_volume.distance_mm[1] : 2.7 * size;
    // A narrow picture needs more distance for the same width.
    const distance = reach / Math.min(camera.aspect, 1) ** 0.7;
    const direction = what === "above" ? [0.001, 1, 0.05] : [0.25, 0.32, 1];
    controls.target.set(0, middle, 0);
    camera.position
      .set(...direction)
      .setLength(distance)
      .add(controls.target);
    camera.near = size / 50;
    camera.far = 20 * distance + 20 * design.working_volume.distance_mm[1];
    camera.updateProjectionMatrix();
    controls.update();
    render();
  }

  function instead(old, made) {
    old.traverse((part) => {
      part.geometry?.dispose();
      part.material?.dispose();
    });
    scene.remove(old);
    scene.add(made);
    return made;
  }
  function show(design, shown, aims) {
    const [low, high] = heightsOf(design);
    const upright = shown.section === "upright";
    plane.normal.set(0, upright ? 0 : -1, upright ? -1 : 0);
    plane.constant = upright
      ? design.diameter_mm * (shown.place - 0.5)
      : low + shown.place * (high - low) * (1 + shown.explode);
    solids = instead(solids, solidsOf(design, shown, shown.section === "none" ? [] : [plane], three));
    if (aims) aim(design, "rig");
    fit();
    showRays(design, shown);
  }
  function showRays(design, shown) {
    lines = instead(lines, linesOf(design, shown, three));
    render();
  }
  return { show, showRays, aim };
}

/** Lowest and highest point of mirrors and lens, mm. */
function heightsOf(design) {
  const heights = design.mirrors.flatMap((mirror) => {
    const profile = faceProfile(mirror, 1, 8).map(([, height]) => height);
    return [...profile, ...profile.map((height) => height + backOffset(mirror))];
  });
  return [Math.min(...heights, design.camera.lens_front_mm), Math.max(...heights)];
}

/** Mirrors, lens and body, cut open. */
function solidsOf(design, shown, planes, three) {
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
  for (const mirror of design.mirrors) {
    const face = faceProfile(mirror, 1);
    const back = face.map(([r, z]) => [r, z + backOffset(mirror)]);
    const lift = shown.explode * 0.45 * (high - low) * (order.indexOf(mirror.name) + 1);
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
  if (seat < camera.lens_front_mm) add(cylinder(camera.lens_radius_mm, seat, camera.lens_front_mm), 0x4a4a4a);
  if (camera.body_radius_mm > 0) add(cylinder(camera.body_radius_mm, bottom, seat), 0x6e6e6e);
  return group;
}

/** Rays of both views, the live ray with its scene point, and the working volume. */
function linesOf(design, shown, three) {
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
