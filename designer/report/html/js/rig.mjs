// The selected design in 3-D: mirrors as cut-open solids, rays of both views, working volume. Drawn by three.js, which
// is read when the section comes into sight; without WebGL a line says so.

import { choice, element, labelled } from "./format.mjs";
import { optionText } from "./rays.mjs";
import { EXPLOSION, heightsOf, linesOf, solidsOf } from "./solids.mjs";
import { change, state, whenChanged } from "./state.mjs";

const NO_WEBGL =
  "This browser offers no WebGL, so the rig cannot be drawn in 3-D. Everything else on this page works without it.";

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
      "Drag to turn, scroll or pinch to zoom; with the keyboard: arrow keys turn, + and − zoom. Blue: upper view; " +
        "orange: lower view; green: working volume; black: the scene point of the live ray.",
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

/** How much taller an exploded rig is. */
function spreadOf(design, explode) {
  return 1 + explode * EXPLOSION * design.mirrors.length;
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
  let lastSpread = 1;

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
      : (low + high) / 2 + (shown.place - 0.5) * (high - low) * spreadOf(design, shown.explode);
    solids = instead(solids, solidsOf(design, shown, shown.section === "none" ? [] : [plane], three));
    if (aims) aim(design, "rig");
    // From as much farther as the parts are spread.
    const spread = spreadOf(design, shown.explode);
    if (spread !== lastSpread) turn(0, 0, aims ? spread : spread / lastSpread);
    lastSpread = spread;
    fit();
    showRays(design, shown);
  }
  function showRays(design, shown) {
    lines = instead(lines, linesOf(design, shown, three));
    render();
  }
  return { show, showRays, aim };
}
