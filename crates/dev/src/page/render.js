// Progress, pause, limits, and downloads of the image.

import { ask, element, lastState, onFrame, onLink, onState } from "/link.js";
import { viewName } from "/view.js";

const MAX_SAMPLES = 65536;
const KINDS = ["png", "exr"];

export function setUpRender(onKey, showNotice) {
  const pause = () => ask({ pause: element("pause").getAttribute("aria-pressed") !== "true" });
  element("pause").addEventListener("click", pause);
  onKey(" ", pause);
  element("restart").addEventListener("click", () => ask("restart"));
  element("most-samples").addEventListener("change", ({ target }) => {
    const { value, valueAsNumber: most, validity } = target;
    const isNone = value === "" && !validity.badInput;
    if (isNone || (Number.isInteger(most) && most >= 1 && most <= MAX_SAMPLES)) {
      showNotice("");
      ask({ samples: isNone ? null : most });
    } else {
      const got = value ? `, not ${value}` : "";
      showNotice(`Max samples must be a whole number from 1 to ${MAX_SAMPLES.toLocaleString("en")}${got}`, true);
      target.value = lastState()?.samples[0] ?? "";
    }
  });
  element("preview").addEventListener("change", ({ target }) => ask({ preview: Number(target.value) }));
  onState((state, isCurrent) => {
    if (!isCurrent) return;
    element("pause").setAttribute("aria-pressed", state.paused);
    element("pause").textContent = state.paused ? "Resume" : "Pause";
    element("pause").title = state.paused ? "Resume rendering (Space)" : "Pause rendering (Space)";
    const [most, all] = state.samples;
    const field = element("most-samples");
    if (document.activeElement !== field) field.value = most ?? "";
    field.placeholder = all || "all";
    element("preview").value = state.preview;
  });
  onFrame(showProgress);
  onLink((isConnected) => isConnected || KINDS.forEach((kind) => allowSave(kind, false)));
}

function showProgress(header) {
  const { samples, total, speed, view, latency } = header;
  const counts = !header.first_hits;
  element("bar").value = !counts ? 1 : total ? samples / total : 0;
  element("samples").textContent = counts ? `${samples} of ${total}` : "1 ray per pixel";
  element("speed").textContent = counts && speed ? withPrefix(speed) : "–";
  if (latency !== null) element("latency").textContent = latency < 1 ? `${Math.round(latency * 1000)} ms` : `${latency.toFixed(2)} s`;
  const isWhole = String(header.sent) === String(header.finest) && (!counts || samples > 0);
  const name = element("scene").textContent.split(/[/\\]/).at(-1).replace(/\.[^.]*$/, "") || "image";
  for (const kind of KINDS) {
    allowSave(kind, isWhole);
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
