// Sliders for annotated shader constants.

import { colorOf, hexOf } from "/color.js";
import { editorLink } from "/editor.js";
import { ask, element, onState } from "/link.js";
import { numberField } from "/numbers.js";
import { enable, keep, make, place } from "/parts.js";

let rows = new Map(); // the rows of the sliders, by file, name and kind
let made = 0; // number of rows made so far, for their ids
let [underWay, waiting] = [false, new Map()]; // values that are not sent yet, by file and name

const keyOf = ({ file, name }) => JSON.stringify([file, name]);
const rowKey = (slider) => JSON.stringify([keyOf(slider), slider.kind]);

export function setUpShader() {
  element("write-sliders").addEventListener("click", () => ask("write_sliders"));
  element("undo-sliders").addEventListener("click", () => ask("undo_sliders"));
  element("reset-sliders").addEventListener("click", () => ask("reset_sliders"));
  onState((state, heard) => {
    rows = keep(rows, state.sliders, rowKey, rowOf);
    for (const slider of state.sliders) rows.get(rowKey(slider)).show(slider, state, heard && !underWay);
    place([element("sliders"), [...rows.values()].map(({ item }) => item)]);
    const moved = state.sliders.some(isMoved);
    enable(element("write-sliders"), moved && state.shaders);
    enable(element("reset-sliders"), moved);
    element("undo-sliders").hidden = !state.sliders_undo;
    element("sliders-help").hidden = state.sliders.length > 0;
  });
}

const isMoved = ({ value, file_value }) => String(value) !== String(file_value);

// Sends one value at a time, the newest of each slider: a drag produces more of them than the program can render.
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
  const note = make("small");
  const reset = make("button", { type: "button", textContent: "Reset" });
  reset.setAttribute("aria-label", `Reset ${slider.name}`);
  const head = make("span", { className: "head" }, name, link, note, reset);
  const { inputs, update } = ({ bool: switchOf, color: colorsOf }[slider.kind] ?? numberOf)(slider);
  inputs[0].id = id;
  reset.addEventListener("click", () => {
    if (reset.matches(":focus-visible")) inputs[0].focus(); // the button disappears
    ask({ reset_slider: [slider.file, slider.name] });
  });
  const item = make("li", {}, head, make("span", { className: "pair" }, ...inputs));
  let isNew = true;
  const show = (now, { editor }, heard) => {
    link.textContent = `${now.file}:${now.line}`;
    const href = editorLink(editor, { file: now.path, line: now.line });
    if (href) link.href = href;
    else link.removeAttribute("href");
    note.textContent = [now.recompiles && "recompiles", !now.used && "not used by this scene"].filter(Boolean).join(", ");
    reset.hidden = !isMoved(now);
    if (heard || isNew) update(now);
    isNew = false;
  };
  return { item, show };
}

function switchOf(slider) {
  const box = make("input", { type: "checkbox" });
  box.addEventListener("change", () => slide(slider, box.checked));
  return { inputs: [box], update: ({ value }) => (box.checked = value) };
}

function numberBox(label) {
  const box = make("input", { type: "number", step: "any" });
  box.setAttribute("aria-label", label);
  return box;
}

function numberOf(slider) {
  const field = { kind: slider.kind === "f32" ? "number" : "whole" }; // range and step follow the file
  let last = slider.value;
  const range = make("input", { type: "range" });
  const box = numberBox(`${slider.name}, as a number`);
  const use = (value) => {
    last = value;
    slide(slider, value);
  };
  range.addEventListener("input", () => {
    show(range.valueAsNumber);
    use(range.valueAsNumber);
  });
  const show = numberField(box, field, () => [last], use);
  const update = ({ min, max, step, value }) => {
    Object.assign(field, { range: [min, max], step });
    last = value;
    const fine = field.kind === "whole" ? 1 : 10 ** Math.floor(Math.log10((max - min) / 500));
    Object.assign(range, { min, max, step: step ?? fine, value });
    show(value);
  };
  return { inputs: [range, box], update };
}

const LIGHT = { kind: "number", range: [0, 3.4e38] };

function colorsOf(slider) {
  let last = slider.value;
  const use = (color) => {
    last = color;
    slide(slider, color);
  };
  const picker = make("input", { type: "color" });
  picker.addEventListener("input", () => use(colorOf(picker.value, last)));
  const boxes = ["red", "green", "blue"].map((name) => numberBox(`${slider.name}, ${name}`));
  const shows = boxes.map((box, i) => numberField(box, LIGHT, () => last, (value) => use(last.with(i, value))));
  const update = ({ value }) => {
    last = value;
    if (picker.value !== hexOf(value)) picker.value = hexOf(value);
    shows.forEach((show, i) => show(value[i]));
  };
  return { inputs: [picker, ...boxes], update };
}
