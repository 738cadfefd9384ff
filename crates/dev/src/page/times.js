// Timings of the kernels and of the stages of a frame.

import { element, onMessage } from "/link.js";

const make = (tag, text) => Object.assign(document.createElement(tag), { textContent: text });

function duration(seconds) {
  const ms = seconds * 1000;
  if (ms >= 1000) return `${seconds.toFixed(2)} s`;
  return ms >= 100 ? `${Math.round(ms)} ms` : ms >= 1 ? `${ms.toPrecision(3)} ms` : `${Math.round(ms * 1000)} µs`;
}

function row(time) {
  const line = document.createElement("tr");
  const name = make("th", time.name);
  name.scope = "row";
  const load = time.share < 0.005 ? "–" : `${Math.round(time.share * 100)}%`;
  const samples = time.kernel ? time.samples.toLocaleString("en") : "";
  line.append(name, ...[duration(time.last), duration(time.median), load, samples].map((text) => make("td", text)));
  return line;
}

export function setUpTimes() {
  const section = element("times");
  let last = [];
  const show = () => {
    if (!section.open) return;
    const [kernels, stages] = [true, false].map((kernel) => last.filter((time) => time.kernel === kernel));
    element("times-kernels").replaceChildren(...kernels.map(row));
    element("times-parts").replaceChildren(...stages.map(row));
    const source = kernels.every((time) => time.by_device) ? "Kernel times from GPU timestamps." : "Kernel times from submission to completion.";
    element("times-clock").textContent = kernels.length ? source : "";
  };
  onMessage("times", (times) => {
    last = times;
    show();
  });
  section.addEventListener("toggle", show);
}
