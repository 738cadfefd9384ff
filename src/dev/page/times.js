// Where the time goes: the kernels' calls, and the parts of a frame.

import { element, onMessage } from "/link.js";

const make = (tag, text) => Object.assign(document.createElement(tag), { textContent: text });

function milliseconds(seconds) {
  const ms = seconds * 1000;
  return ms >= 100 ? `${Math.round(ms)} ms` : ms >= 0.1 ? `${ms.toPrecision(3)} ms` : `${Math.round(ms * 1000)} µs`;
}

function row(time) {
  const line = document.createElement("tr");
  const name = make("th", time.name);
  name.scope = "row";
  const share = time.share < 0.005 ? "–" : `${Math.round(time.share * 100)} %`;
  const samples = time.kernel ? time.samples.toLocaleString("en") : "";
  line.append(name, ...[milliseconds(time.last), milliseconds(time.median), share, samples].map((text) => make("td", text)));
  return line;
}

export function setUpTimes() {
  const section = element("times");
  let last = [];
  const show = () => {
    if (!section.open) return; // nobody looks
    const [kernels, parts] = [true, false].map((kernel) => last.filter((time) => time.kernel === kernel));
    element("times-kernels").replaceChildren(...kernels.map(row));
    element("times-parts").replaceChildren(...parts.map(row));
    const clock = kernels.every((time) => time.by_device) ? "by the device's clock" : "from the call to the news of its end";
    element("times-clock").textContent = kernels.length ? `Kernels ${clock}.` : "";
  };
  onMessage("times", (times) => {
    last = times;
    show();
  });
  section.addEventListener("toggle", show);
}
