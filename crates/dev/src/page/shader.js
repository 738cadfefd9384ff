// Sliders for overrides of shaders.

import { editorLink } from "/editor.js";
import { ask, element, lastState, onState } from "/link.js";
import { numberField } from "/numbers.js";
import { enable, keep, make, place } from "/parts.js";

let rows = new Map(); // the rows of the sliders, by file, name and kind
let made = 0; // number of rows made so far, for their ids
let [underWay, waiting] = [false, new Map()]; // values that are not sent yet, by file and name

const keyOf = ({ file, name }) => JSON.stringify([file, name]);
const rowKey = (slider) => JSON.stringify([keyOf(slider), slider.kind]);
const isMoved = (slider) => slider.value !== slider.default;

export function setUpShader(showNotice) {
  element("copy-sliders").addEventListener("click", () => copy(showNotice));
  element("reset-sliders").addEventListener("click", () => ask("reset_sliders"));
  onState((state, isCurrent) => {
    rows = keep(rows, state.sliders, rowKey, rowOf);
    for (const slider of state.sliders) rows.get(rowKey(slider)).show(slider, state, isCurrent && !underWay);
    place([element("sliders"), [...rows.values()].map(({ item }) => item)]);
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

// Sends one value at a time, the newest of each slider, because a drag produces more values than the program can
// render.
function slide({ file, name }, value) {
  waiting.set(keyOf({ file, name }), { file, name, value });
  if (!underWay) next();
}

async function next() {
  underWay = true;
  while (waiting.size) {
    const [key, value] = waiting.entries().next().value;
    waiting.delete(key);
    await ask({ slide: value });
  }
  underWay = false;
}

// Returns a slider's row and the function that updates it.
function rowOf(slider) {
  const id = `slider-${made++}`;
  const name = make("label", { textContent: slider.name, htmlFor: id });
  const link = make("a");
  const reset = make("button", { type: "button", textContent: "Reset" });
  reset.setAttribute("aria-label", `Reset ${slider.name}`);
  const head = make("span", { className: "head" }, name, link, reset);
  const { inputs, update } = (slider.kind === "bool" ? switchOf : numberOf)(slider);
  inputs[0].id = id;
  reset.addEventListener("click", () => {
    if (reset.matches(":focus-visible")) inputs[0].focus(); // the button disappears
    ask({ reset_slider: [slider.file, slider.name] });
  });
  const item = make("li", {}, head, make("span", { className: "pair" }, ...inputs));
  let isNew = true;
  const show = (now, { editor }, isCurrent) => {
    link.textContent = `${now.file}:${now.line}`;
    const href = editorLink(editor, { file: now.path, line: now.line });
    if (href) link.href = href;
    else link.removeAttribute("href");
    reset.hidden = !isMoved(now);
    if (isCurrent || isNew) update(now);
    isNew = false;
  };
  return { item, show };
}

function switchOf(slider) {
  const box = make("input", { type: "checkbox" });
  box.addEventListener("change", () => slide(slider, box.checked));
  return { inputs: [box], update: ({ value }) => (box.checked = value) };
}

function numberOf(slider) {
  const field = { kind: slider.kind === "f32" ? "number" : "whole" }; // the range follows the file
  let last = slider.value;
  const range = make("input", { type: "range" });
  const box = make("input", { type: "number", step: "any" });
  box.setAttribute("aria-label", `${slider.name}, as a number`);
  const use = (value) => {
    last = value;
    slide(slider, value);
  };
  range.addEventListener("input", () => {
    show(range.valueAsNumber);
    use(range.valueAsNumber);
  });
  const show = numberField(box, field, () => [last], use);
  const update = ({ min, max, value }) => {
    field.range = [min, max];
    last = value;
    const step = field.kind === "whole" ? 1 : 10 ** Math.floor(Math.log10((max - min) / 500));
    Object.assign(range, { min, max, step, value });
    show(value);
  };
  return { inputs: [range, box], update };
}
