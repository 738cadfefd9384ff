// Comparison of the image with a second image: selection of that image, layout, and error measures.

import { element, onFrame, onState, sendCommand } from "/link.js";
import { choose, viewName } from "/view.js";

const selected = (name) => document.querySelector(`input[name=${name}]:checked`).value;
let timer = 0;

export function setUpCompare(picture, onKey, showNotice) {
  element("against").addEventListener("change", () => choose("compare"));
  element("layout").addEventListener("change", arrange);
  element("pace").addEventListener("change", arrange);
  element("gain").addEventListener("change", ({ target }) => sendCommand({ gain: Number(target.value) }));
  element("wipe").addEventListener("input", ({ target }) => picture.wipe(target.valueAsNumber));
  picture.wiping = (position) => (element("wipe").value = position);
  const setReference = () => sendCommand("keep");
  element("keep").addEventListener("click", setReference);
  onKey("t", setReference);
  onKey("x", () => picture.swap());
  element("reference-file").addEventListener("change", ({ target }) => {
    if (target.files[0]) upload(target.files[0]);
    target.value = "";
  });
  const panels = element("panels");
  panels.addEventListener("dragover", (event) => event.preventDefault());
  panels.addEventListener("drop", (event) => {
    event.preventDefault();
    if (event.dataTransfer.files[0]) upload(event.dataTransfer.files[0]);
  });

  function arrange() {
    const layout = selected("layout");
    picture.arrange(layout);
    clearInterval(timer);
    const pace = Number(element("pace").value);
    if (layout === "flicker" && pace) timer = setInterval(() => picture.swap(), 1000 / pace);
  }

  // Uploads a file from the viewer's computer, because the program may run on a different machine.
  async function upload(file) {
    try {
      const answer = await fetch(`/reference/${encodeURIComponent(file.name)}`, { method: "POST", body: file });
      if (!answer.ok) throw new Error((await answer.text()) || `${answer.status} ${answer.statusText}`);
      showNotice("");
      document.querySelector("input[name=against][value=reference]").checked = true;
      choose("compare");
    } catch (error) {
      const { message } = error;
      showNotice(message.startsWith(file.name) ? message : `${file.name}: ${message}`, true);
    }
  }

  onState((state, isCurrent) => {
    element("reference-name").textContent = state.comparable[1] ?? "none";
    const errors = state.apart;
    const number = (value) => (value === null ? "not finite" : value === 0 ? "0" : value.toPrecision(3));
    element("rmse").textContent = errors ? number(errors.rmse) : "–";
    element("flip").textContent = errors ? number(errors.flip) : "–";
    if (!isCurrent) return;
    if (viewName(state.view) === "compare") {
      document.querySelector(`input[name=against][value=${state.view.compare}]`).checked = true;
    }
    element("gain").value = state.gain;
    if (picture.gain !== state.gain) picture.setGain(state.gain);
  });

  onFrame(({ differing, done, view }) => {
    const verdict = element("differing");
    const show = (kind, text) => {
      verdict.className = kind;
      if (verdict.textContent !== text) verdict.textContent = text;
    };
    if (differing) {
      const [pixels, largest] = differing;
      const soFar = done ? "" : " so far";
      const amount = largest === null ? "some by a non-finite amount" : `by at most ${largest.toPrecision(3)}`;
      const count = `${pixels.toLocaleString("en")} ${pixels === 1 ? "pixel differs" : "pixels differ"}`;
      show(pixels ? "differ" : "same", pixels ? `${count}${soFar}, ${amount}` : `0 pixels differ${soFar}: all bits are the same`);
    } else {
      show("", viewName(view) === "compare" ? "Nothing to compare yet" : "–");
    }
  });
  arrange();
}
