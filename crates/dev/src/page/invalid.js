// Invalid pixels: counts of NaN, infinite and negative values in the panel, and a badge on the image that scrolls to
// them.

import { ask, element, onFrame, onState } from "/link.js";

const KINDS = [["nan", "NaN"], ["infinite", "infinite"], ["negative", "negative"]];

export function setUpInvalid() {
  element("marks").addEventListener("change", ({ target }) => ask({ marks: target.checked }));
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

const total = (faults, kind) => faults.reduce((sum, [, found]) => sum + found[kind], 0);

function show({ faults, width, height, sent, sides }) {
  const names = { picture: "", first: `${sides?.[0] ?? "first"}: `, second: `${sides?.[1] ?? "second"}: ` };
  const parts = faults.map(([part, found]) => {
    const counts = KINDS.filter(([kind]) => found[kind]).map(([kind, name]) => `${found[kind].toLocaleString("en")} ${name}`);
    return counts.length ? `${names[part]}${counts.join(", ")}` : "";
  }).filter(Boolean);
  const isCoarse = (width / sent[0]) * (height / sent[1]) > 1.5;
  setText("fault-counts", parts.length ? `Invalid pixels${isCoarse ? " so far" : ""}: ${parts.join("; ")}` : "");
  element("faults").hidden = element("invalid").hidden = !parts.length;
  const found = KINDS.map(([kind, name]) => [total(faults, kind), name]).filter(([count]) => count);
  const count = found.reduce((sum, [count]) => sum + count, 0);
  const name = found.length === 1 ? found[0][1] : "invalid";
  setText("invalid", parts.length ? `${count.toLocaleString("en")} ${name} ${count === 1 ? "pixel" : "pixels"}` : "");
}

// Unchanged text is not set again, because screen readers announce every assignment.
function setText(id, text) {
  if (element(id).textContent !== text) element(id).textContent = text;
}
