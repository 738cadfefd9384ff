// Progress, pause, limits, and downloads of the image.

import { element, lastState, onFrame, onLink, onState, sendCommand } from "/link.js";
import { viewName } from "/view.js";

const MAX_SAMPLES = 65536;
const KINDS = ["png", "exr"];

export function setUpRender(onKey, showNotice) {
  const pause = () => sendCommand({ pause: element("pause").getAttribute("aria-pressed") !== "true" });
  element("pause").addEventListener("click", pause);
  onKey(" ", pause);
  element("restart").addEventListener("click", () => sendCommand("restart"));
  element("max-samples").addEventListener("change", ({ target }) => {
    const { value, valueAsNumber: count, validity } = target;
    const isNone = value === "" && !validity.badInput;
    if (isNone || (Number.isInteger(count) && count >= 1 && count <= MAX_SAMPLES)) {
      showNotice("");
      sendCommand({ samples: isNone ? null : count });
    } else {
      const actual = value ? `, not ${value}` : "";
      showNotice(`Max samples must be a whole number from 1 to ${MAX_SAMPLES.toLocaleString("en")}${actual}`, true);
      target.value = lastState()?.samples[0] ?? "";
    }
  });
  element("preview").addEventListener("change", ({ target }) => sendCommand({ preview: Number(target.value) }));
  onState((state, isCurrent) => {
    if (!isCurrent) return;
    element("pause").setAttribute("aria-pressed", state.paused);
    element("pause").textContent = state.paused ? "Resume" : "Pause";
    element("pause").title = state.paused ? "Resume rendering (Space)" : "Pause rendering (Space)";
    const [max, sceneSamples] = state.samples;
    const field = element("max-samples");
    if (document.activeElement !== field) field.value = max ?? "";
    field.placeholder = sceneSamples || "all";
    element("preview").value = state.preview;
  });
  onFrame(showProgress);
  onLink((isConnected) => isConnected || KINDS.forEach((kind) => allowSave(kind, false)));
}

function showProgress(header) {
  const { samples, total, speed, view, latency } = header;
  const hasSamples = !header.first_hits;
  element("bar").value = !hasSamples ? 1 : total ? samples / total : 0;
  element("samples").textContent = hasSamples ? `${samples} of ${total}` : "1 ray per pixel";
  element("speed").textContent = hasSamples && speed ? withPrefix(speed) : "–";
  if (latency !== null) element("latency").textContent = latency < 1 ? `${Math.round(latency * 1000)} ms` : `${latency.toFixed(2)} s`;
  const isComplete = String(header.sent) === String(header.finest) && (!hasSamples || samples > 0);
  const name = element("scene").textContent.split(/[/\\]/).at(-1).replace(/\.[^.]*$/, "") || "image";
  for (const kind of KINDS) {
    allowSave(kind, isComplete);
    element(`save-${kind}`).download = viewName(view) === "color" ? `${name}.${kind}` : `${name}-${viewName(view)}.${kind}`;
  }
}

// Enables a download link, or disables it by removing its URL.
function allowSave(kind, isAllowed) {
  const link = element(`save-${kind}`);
  link.setAttribute("aria-disabled", !isAllowed);
  if (isAllowed) link.href = `/picture.${kind}`;
  else link.removeAttribute("href");
}

function withPrefix(n) {
  const [divisor, prefix] = n >= 1e9 ? [1e9, " G"] : n >= 1e6 ? [1e6, " M"] : n >= 1e3 ? [1e3, " k"] : [1, ""];
  return (n / divisor).toPrecision(3) + prefix;
}
