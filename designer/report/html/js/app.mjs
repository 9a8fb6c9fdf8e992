// Puts the page together from the data in it.

import { buildCompare } from "./compare.mjs";
import { element, typographic } from "./format.mjs";
import { buildRays } from "./rays.mjs";
import { buildRig } from "./rig.mjs";
import { change, state, whenChanged } from "./state.mjs";
import { buildTable } from "./table.mjs";
import { buildTrade } from "./trade.mjs";

const data = JSON.parse(document.getElementById("payload").textContent);

function summary() {
  const counts = new Map();
  for (const row of data.rows) counts.set(row.status, (counts.get(row.status) ?? 0) + 1);
  if (counts.has("not judged")) return "";
  const words = [...counts].map(([status, count]) => `${count} ${status}`).join(", ");
  return `${data.rows.length} configuration${data.rows.length === 1 ? "" : "s"}: ${words}.`;
}

function facts() {
  const groups = data.facts.map(([title, pairs]) => [title, pairs]);
  const origin = Object.entries(data.provenance).map(([name, value]) => [
    name === "designer" ? "designer version" : name,
    String(value),
  ]);
  if (origin.length) groups.push(["Origin", origin]);
  return groups.map(([title, pairs]) =>
    element(
      "div",
      {},
      element("h3", {}, title),
      element(
        "dl",
        {},
        ...pairs.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, typographic(value))]),
      ),
    ),
  );
}

function start() {
  document.getElementById("summary").textContent = summary();
  const places = document.getElementById("facts");
  places.className = "facts";
  places.append(...facts());
  const names = Object.keys(data.designs);
  const markRow = buildTable(data);
  whenChanged((changed) => {
    if (changed.has("selected")) markRow();
  });
  buildTrade(data);
  buildRays(data);
  buildRig(data);
  buildCompare(data);
  const asked = new URLSearchParams(location.hash.slice(1)).get("design");
  change({
    selected: data.designs[asked] ? asked : (names[0] ?? data.rows[0]?.configuration ?? null),
    first: names[0] ?? null,
    second: names[1] ?? names[0] ?? null,
  });
}

// The head of the page is on the screen before the rest is built.
if (document.visibilityState === "hidden") start();
else requestAnimationFrame(() => setTimeout(start));
