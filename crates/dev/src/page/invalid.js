// Invalid pixels: counts of NaN, infinite and negative values in the panel, and a badge on the image that scrolls to
// the counts.

import { element, onFrame, onState, sendCommand } from "/link.js";

const KINDS = [["nan", "NaN"], ["infinite", "infinite"], ["negative", "negative"]];

export function setUpInvalid() {
  element("marks").addEventListener("change", ({ target }) => sendCommand({ marks: target.checked }));
  element("invalid").addEventListener("click", reveal);
  onState((state, isCurrent) => {
    if (isCurrent) element("marks").checked = state.marks;
  });
  onFrame(show);
}

// Scrolls to the counts and focuses them.
function reveal() {
  element("display").open = true;
  const faults = element("faults");
  faults.tabIndex = -1;
  faults.focus({ preventScroll: true });
  faults.scrollIntoView({ block: "nearest" });
}

const total = (faults, kind) => faults.reduce((sum, [, counts]) => sum + counts[kind], 0);

function show({ faults, width, height, sent, sides }) {
  const names = { picture: "", first: `${sides?.[0] ?? "first"}: `, second: `${sides?.[1] ?? "second"}: ` };
  const texts = faults.map(([part, counts]) => {
    const list = KINDS.filter(([kind]) => counts[kind]).map(([kind, name]) => `${counts[kind].toLocaleString("en")} ${name}`);
    return list.length ? `${names[part]}${list.join(", ")}` : "";
  }).filter(Boolean);
  const isCoarse = (width / sent[0]) * (height / sent[1]) > 1.5;
  setText("fault-counts", texts.length ? `Invalid pixels${isCoarse ? " so far" : ""}: ${texts.join("; ")}` : "");
  element("faults").hidden = element("invalid").hidden = !texts.length;
  const totals = KINDS.map(([kind, name]) => [total(faults, kind), name]).filter(([count]) => count);
  const count = totals.reduce((sum, [count]) => sum + count, 0);
  const name = totals.length === 1 ? totals[0][1] : "invalid";
  setText("invalid", texts.length ? `${count.toLocaleString("en")} ${name} ${count === 1 ? "pixel" : "pixels"}` : "");
}

// Sets a text if it has changed, because screen readers announce every assignment.
function setText(id, text) {
  if (element(id).textContent !== text) element(id).textContent = text;
}
