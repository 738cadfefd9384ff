// Sliders for overrides of shaders.

import { editorLink } from "/editor.js";
import { element, lastState, onState, sendCommand } from "/link.js";
import { numberField } from "/numbers.js";
import { enable, make, reuse, setChildren } from "/parts.js";

let rows = new Map(); // the rows of the sliders, by file, name and kind
let rowCount = 0; // number of rows created so far, for the ids of the rows
let [isSending, waiting] = [false, new Map()]; // whether a value is being sent, and the next values by file and name

const keyOf = ({ file, name }) => JSON.stringify([file, name]);
const rowKey = (slider) => JSON.stringify([keyOf(slider), slider.kind]);
const isMoved = (slider) => slider.value !== slider.default;

export function setUpShader(showNotice) {
  element("copy-sliders").addEventListener("click", () => copy(showNotice));
  element("reset-sliders").addEventListener("click", () => sendCommand("reset_sliders"));
  onState((state, isCurrent) => {
    rows = reuse(rows, state.sliders, rowKey, makeRow);
    for (const slider of state.sliders) rows.get(rowKey(slider)).show(slider, state, isCurrent && !isSending);
    setChildren([element("sliders"), [...rows.values()].map(({ item }) => item)]);
    const moved = state.sliders.some(isMoved);
    for (const id of ["copy-sliders", "reset-sliders"]) enable(element(id), moved);
    element("sliders-help").hidden = state.sliders.length > 0;
  });
}

// Copies the declarations of the changed sliders to the clipboard.
async function copy(showNotice) {
  const range = ({ kind, min, max }) => (kind === "bool" ? "" : ` // ${min}..${max}`);
  const line = (slider) => `override ${slider.name}: ${slider.kind} = ${slider.value};${range(slider)}\n`;
  const text = lastState().sliders.filter(isMoved).map(line).join("");
  try {
    await navigator.clipboard.writeText(text);
    showNotice("Declarations copied");
  } catch {
    showNotice(text); // the clipboard needs a secure connection
  }
}

// Sends the newest value of each slider, one value at a time, because a drag produces more values than the program can
// render.
function slide({ file, name }, value) {
  waiting.set(keyOf({ file, name }), { file, name, value });
  if (!isSending) sendWaiting();
}

async function sendWaiting() {
  isSending = true;
  while (waiting.size) {
    const [key, value] = waiting.entries().next().value;
    waiting.delete(key);
    await sendCommand({ slide: value });
  }
  isSending = false;
}

// Returns a slider's row and the function that updates it.
function makeRow(slider) {
  const id = `slider-${rowCount++}`;
  const name = make("label", { textContent: slider.name, htmlFor: id });
  const link = make("a");
  const reset = make("button", { type: "button", textContent: "Reset" });
  reset.setAttribute("aria-label", `Reset ${slider.name}`);
  const head = make("span", { className: "head" }, name, link, reset);
  const { inputs, update } = (slider.kind === "bool" ? switchControl : numberControl)(slider);
  inputs[0].id = id;
  reset.addEventListener("click", () => {
    if (reset.matches(":focus-visible")) inputs[0].focus(); // the button disappears
    sendCommand({ reset_slider: [slider.file, slider.name] });
  });
  const item = make("li", {}, head, make("span", { className: "pair" }, ...inputs));
  let isNew = true;
  const show = (slider, { editor }, isCurrent) => {
    link.textContent = `${slider.file}:${slider.line}`;
    const href = editorLink(editor, { file: slider.path, line: slider.line });
    if (href) link.href = href;
    else link.removeAttribute("href");
    reset.hidden = !isMoved(slider);
    if (isCurrent || isNew) update(slider);
    isNew = false;
  };
  return { item, show };
}

function switchControl(slider) {
  const box = make("input", { type: "checkbox" });
  box.addEventListener("change", () => slide(slider, box.checked));
  return { inputs: [box], update: ({ value }) => (box.checked = value) };
}

function numberControl(slider) {
  const field = { kind: slider.kind === "f32" ? "number" : "whole" }; // `update` sets the range
  let last = slider.value;
  const range = make("input", { type: "range" });
  const box = make("input", { type: "number", step: "any" });
  box.setAttribute("aria-label", `${slider.name}, as a number`);
  const onValue = (value) => {
    last = value;
    slide(slider, value);
  };
  range.addEventListener("input", () => {
    show(range.valueAsNumber);
    onValue(range.valueAsNumber);
  });
  const show = numberField(box, field, () => [last], onValue);
  const update = ({ min, max, value }) => {
    field.range = [min, max];
    last = value;
    const step = field.kind === "whole" ? 1 : 10 ** Math.floor(Math.log10((max - min) / 500));
    Object.assign(range, { min, max, step, value });
    show(value);
  };
  return { inputs: [range, box], update };
}
