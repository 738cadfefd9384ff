// Controls for the values of an object: number boxes, sliders, colours, vectors, choices, switches and texts. Each of
// these functions returns {inputs, elements, update}. It calls `change(value, i)` with the new value; `i` is the
// changed index of a list.

import { colorOf, hexOf } from "/color.js";
import { digits, fit, numberField, say } from "/numbers.js";
import { make } from "/parts.js";

const STEPS = 1000; // positions of a logarithmic slider

export const valueOf = (field) => field.value ?? field.default;

// Returns a control that matches the kind of the field.
export function controlOf(field, change) {
  const makers = { number: numberOf, whole: numberOf, color: colorsOf, vector: vectorOf, choice: choiceOf, switch: switchOf, text: textOf };
  return makers[field.kind](field, change);
}

function numberBox(field, label) {
  const box = make("input", { type: "number", step: field.kind === "whole" ? "1" : "any" });
  if (field.range) [box.min, box.max] = field.range.map(say);
  box.setAttribute("aria-label", label);
  box.inputMode = "decimal";
  return box;
}

// Returns a number box, with a slider beside it if the field has one.
function pairOf(field, label, slider, change) {
  const box = numberBox(field, label);
  let now;
  const range = slider ? make("input", { type: "range" }) : null;
  // If only square numbers are valid, the slider's position is the square root.
  const placeOf = (x) => {
    if (field.squares) return Math.sqrt(x);
    return slider.logarithmic ? (STEPS * Math.log(x / slider.from)) / Math.log(slider.to / slider.from) : x;
  };
  const number = (at) => {
    if (field.squares) return at * at;
    return slider.logarithmic ? digits(slider.from * (slider.to / slider.from) ** (at / STEPS), 3) : at;
  };
  const ends = () => {
    if (field.squares) return [Math.ceil(Math.sqrt(slider.from)), Math.floor(Math.sqrt(slider.to)), 1];
    return slider.logarithmic ? [0, STEPS, 1] : [slider.from, slider.to, slider.step];
  };
  const take = (x) => {
    now = x;
    if (!range) return;
    range.value = say(x === undefined ? range.min : placeOf(x));
    range.setAttribute("aria-valuetext", say(x));
  };
  const use = (x) => {
    take(x);
    change(x);
  };
  const show = numberField(box, field, () => [now], use);
  if (range) {
    range.setAttribute("aria-label", `${label}, slider`);
    range.addEventListener("input", () => {
      now = fit(field, number(range.valueAsNumber), now ?? 0);
      show(now);
      range.setAttribute("aria-valuetext", say(now));
      change(now);
    });
  }
  const update = (x, next) => {
    show(x);
    slider = next ?? slider;
    if (range) {
      const [low, high, step] = ends();
      Object.assign(range, { min: say(low), max: say(high), step: say(step) });
    }
    take(x);
  };
  const inputs = range ? [range, box] : [box];
  return { inputs, element: make("div", { className: range ? "pair" : "single" }, ...inputs), update };
}

function numberOf(field, change) {
  const pair = pairOf(field, field.name, field.slider, change);
  const update = (next) => pair.update(valueOf(next), next.slider);
  return { inputs: pair.inputs, elements: [pair.element], update };
}

function colorsOf(field, change) {
  const picker = make("input", { type: "color", title: "Colour as displayed (sRGB)" });
  picker.setAttribute("aria-label", `${field.name}, as displayed (sRGB)`);
  let now = [0, 0, 0];
  let tint = [1, 1, 1]; // the colour at strength 1; kept when the strength is 0
  const take = (list) => {
    now = list;
    const most = Math.max(...now);
    if (most > 0) tint = now.map((x) => x / most);
  };
  picker.addEventListener("input", () => {
    if (picker.value === hexOf(now)) return;
    take(colorOf(picker.value, now));
    parts.show(now);
    change(now);
  });
  const parts = numbersOf(field, ["red", "green", "blue"].map((name) => `${field.name}, linear ${name}`), (list, i) => {
    take(list);
    picker.value = hexOf(now);
    change(now, i);
  });
  // Emission has no upper limit, so a single slider scales the colour and keeps its hue.
  const strength = field.slider && pairOf({ ...field, kind: "number" }, `${field.name}, strength`, field.slider, (most) => {
    now = tint.map((x) => digits(x * most, 6));
    picker.value = hexOf(now);
    parts.show(now);
    change(now);
  });
  const legend = make("small", { className: "quiet" });
  const update = (next) => {
    take(valueOf(next) ?? [0, 0, 0]);
    picker.value = hexOf(now);
    parts.update(next);
    const most = Math.max(...now);
    strength?.update(most, next.slider);
    const scale = most > 1 ? ` of the colour divided by ${digits(most, 4)}` : "";
    legend.textContent = `Swatch: sRGB${scale}. R, G, B: linear`;
  };
  const elements = [make("div", { className: "color" }, picker, ...parts.inputs), legend];
  if (strength) elements.push(make("small", { className: "strength", textContent: "Strength (largest channel)" }), strength.element);
  return { inputs: [picker, ...parts.inputs, ...(strength?.inputs ?? [])], elements, update };
}

// Number boxes for a list.
function numbersOf(field, labels, change) {
  let now = [];
  const boxes = labels.map((label) => numberBox(field, label));
  const shows = boxes.map((box, i) => {
    const use = (x) => {
      now = boxes.map((other, j) => now[j] ?? (Number.isFinite(other.valueAsNumber) ? other.valueAsNumber : 0));
      now[i] = x;
      change([...now], i);
    };
    return numberField(box, field, () => now, use);
  });
  const show = (list) => {
    now = [...list];
    shows.forEach((show, i) => show(list[i]));
  };
  return { inputs: boxes, show, update: (next) => show(valueOf(next) ?? []) };
}

function vectorOf(field, change) {
  const names = field.length <= 4 ? ["x", "y", "z", "w"] : [];
  const labels = Array.from({ length: field.length }, (_, i) => `${field.name}, ${names[i] ?? i + 1}`);
  const parts = numbersOf(field, labels, change);
  return { inputs: parts.inputs, elements: [make("div", { className: "vector" }, ...parts.inputs)], update: parts.update };
}

function choiceOf(field, change) {
  const box = make("select");
  box.setAttribute("aria-label", field.name);
  box.addEventListener("change", () => box.value && change(box.value));
  let shown = "";
  const update = (next) => {
    const choices = valueOf(next) === undefined ? ["", ...next.choices] : next.choices;
    if (JSON.stringify(choices) !== shown) box.replaceChildren(...choices.map((value) => make("option", { value, textContent: value || "–" })));
    shown = JSON.stringify(choices);
    box.value = valueOf(next) ?? "";
  };
  return { inputs: [box], elements: [box], update };
}

function switchOf(field, change) {
  const box = make("input", { type: "checkbox" });
  box.addEventListener("change", () => change(box.checked));
  const update = (next) => (box.checked = valueOf(next) ?? false);
  return { inputs: [box], elements: [make("label", { className: "check" }, box, field.name)], update };
}

function textOf(field) {
  const box = make("input", { type: "text", readOnly: true });
  box.setAttribute("aria-label", field.name);
  const update = (next) => (box.value = say(valueOf(next)));
  return { inputs: [box], elements: [box], update };
}
