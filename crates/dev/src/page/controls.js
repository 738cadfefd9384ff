// Controls for the values of an object: number boxes, sliders, colours, vectors, choices, switches and text fields. The
// function of each kind returns {inputs, elements, update}. The control calls `change(value, i)` with the new value;
// for a list, `i` is the index of the changed element.

import { colorOf, hexOf } from "/color.js";
import { digits, fit, format, numberField } from "/numbers.js";
import { make } from "/parts.js";

const STEPS = 1000; // positions of a logarithmic slider

export const valueOf = (field) => field.value ?? field.default;

// Returns a control that matches the kind of the field.
export function makeControl(field, change) {
  const makers = { number: numberControl, whole: numberControl, color: colorControl, vector: vectorControl, choice: choiceControl, switch: switchControl, text: textControl };
  return makers[field.kind](field, change);
}

function numberBox(field, label) {
  const box = make("input", { type: "number", step: field.kind === "whole" ? "1" : "any" });
  if (field.range) [box.min, box.max] = field.range.map(format);
  box.setAttribute("aria-label", label);
  box.inputMode = "decimal";
  return box;
}

// Returns a number box and, if the field has a slider, a slider.
function numberPair(field, label, slider, change) {
  const box = numberBox(field, label);
  let current;
  const range = slider ? make("input", { type: "range" }) : null;
  // If only square numbers are valid, the slider's position is the square root.
  const position = (x) => {
    if (field.squares) return Math.sqrt(x);
    return slider.logarithmic ? (STEPS * Math.log(x / slider.from)) / Math.log(slider.to / slider.from) : x;
  };
  const numberAt = (position) => {
    if (field.squares) return position * position;
    return slider.logarithmic ? digits(slider.from * (slider.to / slider.from) ** (position / STEPS), 3) : position;
  };
  const limits = () => {
    if (field.squares) return [Math.ceil(Math.sqrt(slider.from)), Math.floor(Math.sqrt(slider.to)), 1];
    return slider.logarithmic ? [0, STEPS, 1] : [slider.from, slider.to, slider.step];
  };
  const setNumber = (x) => {
    current = x;
    if (!range) return;
    range.value = format(x === undefined ? range.min : position(x));
    range.setAttribute("aria-valuetext", format(x));
  };
  const onValue = (x) => {
    setNumber(x);
    change(x);
  };
  const show = numberField(box, field, () => [current], onValue);
  if (range) {
    range.setAttribute("aria-label", `${label}, slider`);
    range.addEventListener("input", () => {
      current = fit(field, numberAt(range.valueAsNumber), current ?? 0);
      show(current);
      range.setAttribute("aria-valuetext", format(current));
      change(current);
    });
  }
  const update = (x, next) => {
    show(x);
    slider = next ?? slider;
    if (range) {
      const [low, high, step] = limits();
      Object.assign(range, { min: format(low), max: format(high), step: format(step) });
    }
    setNumber(x);
  };
  const inputs = range ? [range, box] : [box];
  return { inputs, element: make("div", { className: range ? "pair" : "single" }, ...inputs), update };
}

function numberControl(field, change) {
  const pair = numberPair(field, field.name, field.slider, change);
  const update = (next) => pair.update(valueOf(next), next.slider);
  return { inputs: pair.inputs, elements: [pair.element], update };
}

function colorControl(field, change) {
  const picker = make("input", { type: "color", title: "Colour as displayed (sRGB)" });
  picker.setAttribute("aria-label", `${field.name}, as displayed (sRGB)`);
  let current = [0, 0, 0];
  let tint = [1, 1, 1]; // the colour at strength 1; kept when the strength is 0
  const setColor = (list) => {
    current = list;
    const largest = Math.max(...current);
    if (largest > 0) tint = current.map((x) => x / largest);
  };
  picker.addEventListener("input", () => {
    if (picker.value === hexOf(current)) return;
    setColor(colorOf(picker.value, current));
    boxes.show(current);
    change(current);
  });
  const boxes = numberBoxes(field, ["red", "green", "blue"].map((name) => `${field.name}, linear ${name}`), (list, i) => {
    setColor(list);
    picker.value = hexOf(current);
    change(current, i);
  });
  // Emission has no upper limit, so a single slider scales the colour and keeps its hue.
  const strength = field.slider && numberPair({ ...field, kind: "number" }, `${field.name}, strength`, field.slider, (largest) => {
    current = tint.map((x) => digits(x * largest, 6));
    picker.value = hexOf(current);
    boxes.show(current);
    change(current);
  });
  const legend = make("small", { className: "quiet" });
  const update = (next) => {
    setColor(valueOf(next) ?? [0, 0, 0]);
    picker.value = hexOf(current);
    boxes.update(next);
    const largest = Math.max(...current);
    strength?.update(largest, next.slider);
    const scale = largest > 1 ? ` of the colour divided by ${digits(largest, 4)}` : "";
    legend.textContent = `Swatch: sRGB${scale}. R, G, B: linear`;
  };
  const elements = [make("div", { className: "color" }, picker, ...boxes.inputs), legend];
  if (strength) elements.push(make("small", { className: "strength", textContent: "Strength (largest channel)" }), strength.element);
  return { inputs: [picker, ...boxes.inputs, ...(strength?.inputs ?? [])], elements, update };
}

// Returns number boxes for a list.
function numberBoxes(field, labels, change) {
  let current = [];
  const boxes = labels.map((label) => numberBox(field, label));
  const showNumber = boxes.map((box, i) => {
    const onValue = (x) => {
      current = boxes.map((box, j) => current[j] ?? (Number.isFinite(box.valueAsNumber) ? box.valueAsNumber : 0));
      current[i] = x;
      change([...current], i);
    };
    return numberField(box, field, () => current, onValue);
  });
  const show = (list) => {
    current = [...list];
    showNumber.forEach((show, i) => show(list[i]));
  };
  return { inputs: boxes, show, update: (next) => show(valueOf(next) ?? []) };
}

function vectorControl(field, change) {
  const names = field.length <= 4 ? ["x", "y", "z", "w"] : [];
  const labels = Array.from({ length: field.length }, (_, i) => `${field.name}, ${names[i] ?? i + 1}`);
  const boxes = numberBoxes(field, labels, change);
  return { inputs: boxes.inputs, elements: [make("div", { className: "vector" }, ...boxes.inputs)], update: boxes.update };
}

function choiceControl(field, change) {
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

function switchControl(field, change) {
  const box = make("input", { type: "checkbox" });
  box.addEventListener("change", () => change(box.checked));
  const update = (next) => (box.checked = valueOf(next) ?? false);
  return { inputs: [box], elements: [make("label", { className: "check" }, box, field.name)], update };
}

function textControl(field) {
  const box = make("input", { type: "text", readOnly: true });
  box.setAttribute("aria-label", field.name);
  const update = (next) => (box.value = format(valueOf(next)));
  return { inputs: [box], elements: [box], update };
}
