// What the parts of the page share: the selected configuration, the two compared, and the scene point.

const listeners = [];

export const state = {
  selected: null,
  first: null,
  second: null,
  elevationShare: 0.5,
  distanceShare: 0.25,
  view: "both",
};

/** Call a function after every change, with the names of what has changed. */
export function whenChanged(listener) {
  listeners.push(listener);
}

/** Change some of it and tell everyone. */
export function change(values) {
  const changed = Object.keys(values).filter((name) => state[name] !== values[name]);
  Object.assign(state, values);
  if (changed.length) for (const listener of listeners) listener(new Set(changed));
}

/** The scene point in a design's working volume: elevation from the middle of the baseline (rad), distance (mm). */
export function scenePoint(design) {
  const [low, high] = design.working_volume.elevation_deg;
  const [near, far] = design.working_volume.distance_mm;
  return {
    elevation: ((low + (high - low) * state.elevationShare) * Math.PI) / 180,
    distance: near * (far / near) ** state.distanceShare,
  };
}
