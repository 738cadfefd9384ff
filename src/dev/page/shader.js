// Sliders of constants that shaders mark.

import { editorLink } from "/editor.js";
import { ask, element, onState } from "/link.js";

const rows = new Map(); // what shows each slider, by file and name
let [underWay, waiting] = [false, new Map()]; // the values that are not asked for yet, by file and name

const keyOf = ({ file, name }) => JSON.stringify([file, name]);
const make = (tag, properties = {}) => Object.assign(document.createElement(tag), properties);

export function setUpShader() {
  element("write-sliders").addEventListener("click", () => ask("write_sliders"));
  element("undo-sliders").addEventListener("click", () => ask("undo_sliders"));
  element("reset-sliders").addEventListener("click", () => ask("reset_sliders"));
  onState((state, heard) => {
    const keys = state.sliders.map((slider) => JSON.stringify([keyOf(slider), slider.kind]));
    if (String(keys) !== String([...rows.values()].map((row) => row.key))) {
      rows.clear();
      state.sliders.forEach((slider, i) => rows.set(keyOf(slider), { key: keys[i], ...rowOf(slider) }));
      element("sliders").replaceChildren(...[...rows.values()].map((row) => row.item));
    }
    for (const slider of state.sliders) rows.get(keyOf(slider)).show(slider, state, heard && !underWay);
    const moved = state.sliders.some(isMoved);
    element("write-sliders").disabled = !moved || !state.shaders;
    element("reset-sliders").disabled = !moved;
    element("undo-sliders").hidden = !state.sliders_undo;
    element("sliders-help").hidden = state.sliders.length > 0;
  });
}

const isMoved = ({ value, file_value }) => String(value) !== String(file_value);

// One value at a time is asked for, the newest of each slider: a drag makes more of them than are drawn.
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

// A slider's row, and what shows its values in it.
function rowOf(slider) {
  const item = make("li");
  const id = `slider-${rows.size}`;
  const name = make("label", { textContent: slider.name, htmlFor: id });
  const place = make("a");
  const note = make("small");
  const reset = make("button", { type: "button", textContent: "Reset" });
  reset.setAttribute("aria-label", `Reset ${slider.name}`);
  reset.addEventListener("click", () => ask({ reset_slider: [slider.file, slider.name] }));
  const fields = make("span", { className: "pair" });
  const head = make("span", { className: "head" });
  head.append(name, place, note, reset);
  const make_fields = { bool: switchOf, color: colorOf }[slider.kind] ?? numberOf;
  const showValue = make_fields(slider, id, fields);
  item.append(head, fields);
  const show = (now, { editor }, heard) => {
    place.textContent = `${now.file}:${now.line}`;
    const link = editorLink(editor, { file: now.path, line: now.line });
    if (link) place.href = link;
    else place.removeAttribute("href");
    note.textContent = [now.recompiles && "compiles anew", !now.used && "not used by this scene"].filter(Boolean).join(", ");
    reset.hidden = !isMoved(now);
    if (heard) showValue(now);
  };
  return { item, show };
}

function switchOf(slider, id, fields) {
  const box = make("input", { type: "checkbox", id });
  box.addEventListener("change", () => slide(slider, box.checked));
  fields.append(box);
  return ({ value }) => (box.checked = value);
}

// A field for a number, which is told once it is typed.
function fieldOf(label, told) {
  const field = make("input", { type: "number", step: "any" });
  field.setAttribute("aria-label", label);
  let typing = false;
  field.addEventListener("input", () => (typing = true));
  field.addEventListener("blur", () => (typing = false));
  field.addEventListener("change", () => {
    typing = false;
    if (field.value !== "") told(Number(field.value));
  });
  return [field, (value) => {
    if (!typing && field.value !== String(value)) field.value = value;
  }];
}

function numberOf(slider, id, fields) {
  const { min, max, step, kind } = slider;
  const fine = kind === "f32" ? 10 ** Math.floor(Math.log10((max - min) / 500)) : 1;
  const range = make("input", { type: "range", id, min, max, step: step ?? fine, value: slider.value });
  range.addEventListener("input", () => {
    showNumber(Number(range.value));
    slide(slider, Number(range.value));
  });
  const [field, showNumber] = fieldOf(`${slider.name}, as a number`, (value) => slide(slider, value));
  fields.append(range, field);
  return (now) => {
    Object.assign(range, { min: now.min, max: now.max });
    if (Number(range.value) !== now.value) range.value = now.value;
    showNumber(now.value);
  };
}

// Colours are linear; what a browser chooses one by is not.
const shown = (x) => Math.round(255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * Math.min(x, 1) ** (1 / 2.4) - 0.055));
const linear = (byte) => {
  const x = byte / 255;
  return Number((x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4).toPrecision(4));
};

function colorOf(slider, id, fields) {
  let last = slider.value;
  const input = make("input", { type: "color", id });
  input.addEventListener("input", () => {
    last = [1, 3, 5].map((at) => linear(parseInt(input.value.slice(at, at + 2), 16)));
    slide(slider, last);
  });
  const parts = ["red", "green", "blue"].map((name, i) =>
    fieldOf(`${slider.name}, ${name}`, (value) => {
      last = last.map((old, at) => (at === i ? value : old));
      slide(slider, last);
    }));
  fields.append(input, ...parts.map(([field]) => field));
  return ({ value }) => {
    last = value;
    const hex = `#${value.map((x) => shown(x).toString(16).padStart(2, "0")).join("")}`;
    if (input.value !== hex) input.value = hex;
    parts.forEach(([, show], i) => show(value[i]));
  };
}
