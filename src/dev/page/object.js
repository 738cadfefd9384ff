// The object that was clicked: its lines in the scene file, and its values as controls that write into it.

import { colorOf, hexOf } from "/color.js";
import { ask, element, lastState, onLink, onMessage, onState, put } from "/link.js";
import { digits, fit, numberField, say } from "/numbers.js";
import { keep, make, place } from "/parts.js";

const STEPS = 1000; // of a slider that goes by factors
const MOVING = /^(Arrow|Page|Home$|End$)/; // keys that move a control
const LISTED = 250; // milliseconds without a key before names are asked for

let asked = null; // the pixel, or the name and the material, that was asked for
let scenes = null; // which scene it was asked of
let groups = new Map(); // the tables that are shown, by their names
let gesture = Math.floor(Math.random() * 2 ** 40); // changes of one gesture are one step of undo
let held = null; // the path whose control is being moved
let [pointer, key] = [false, false]; // whether it is by the pointer, and by a key that is down
let stale = false; // whether all must be shown anew once it is let go
let sending = null; // the change that waits for the program
let waiting = new Map(); // those after it, of each value and gesture the newest

// Selects what is at a pixel of the picture.
export function select(pixel) {
  asked = { at: pixel };
  element("object").open = true;
  scenes = lastState()?.scenes;
  put({ object: pixel });
}

function inspect(name, material) {
  asked = { name, material };
  scenes = lastState()?.scenes;
  put({ inspect: asked });
}

// The same again: the scene has changed.
function again() {
  if (asked?.at) put({ object: asked.at });
  else if (asked) inspect(asked.name, asked.material);
}

export function setUpObject() {
  const find = element("object-find");
  let timer = 0;
  const list = () => put({ objects: find.value });
  find.addEventListener("input", () => {
    clearTimeout(timer);
    const known = [...element("object-names").children].some((option) => option.value === find.value);
    if (known) inspect(find.value);
    else timer = setTimeout(list, LISTED);
  });
  find.addEventListener("focus", list);
  find.addEventListener("change", () => find.value && inspect(find.value));
  onMessage("objects", ({ objects, more }) => {
    const options = objects.map(([value, label]) => make("option", { value, label }));
    element("object-names").replaceChildren(...options);
    element("object-more").textContent = more ? `${more.toLocaleString("en")} more: type a part of the name` : "";
  });
  onMessage("object", showObject);
  element("undo-write").addEventListener("click", () => ask("undo_write"));
  element("redo-write").addEventListener("click", () => ask("redo_write"));
  document.addEventListener("keydown", (event) => {
    const isText = event.target.matches?.("textarea, input:not([type=range], [type=checkbox], [type=radio], [type=color])");
    if (!(event.ctrlKey || event.metaKey) || event.altKey || isText || event.key.toLowerCase() !== "z") return;
    event.preventDefault();
    ask(event.shiftKey ? "redo_write" : "undo_write");
  });
  // However a press ends, and wherever: as a click, as a scroll, in another window. A key may be down by then.
  for (const end of ["pointerup", "pointercancel", "blur"]) {
    window.addEventListener(end, () => setTimeout(() => {
      if (pointer && !key) letGo();
      pointer = false;
    }));
  }
  onLink(() => {
    scenes = null;
    [sending, waiting] = [null, new Map()];
  });
  onState((state) => {
    for (const [id, what, word] of [["undo-write", state.undo, "Undo"], ["redo-write", state.redo, "Redo"]]) {
      element(id).disabled = !what;
      element(id).textContent = what ? `${word} ${what}` : word;
    }
    settle(state);
    if (state.scenes !== scenes) {
      scenes = state.scenes;
      again();
    }
  });
}

// Writes a value, or the number `i` of a list: what others do to its other numbers stays. One change goes at a time, the next when
// the last was followed, so that a slider never runs ahead of the file.
function write(field, value, i, note) {
  const isPart = i !== undefined && valueOf(field) !== undefined;
  const set = { path: isPart ? `${field.path}[${i}]` : field.path, value: isPart ? value[i] : value, gesture };
  waiting.set(`${set.path} ${gesture}`, { field: field.path, set, note, number: null });
  if (!sending) send();
}

async function send() {
  const [first] = waiting;
  if (!first) return;
  const [key, change] = first;
  waiting.delete(key);
  sending = change;
  change.number = await ask({ set: change.set });
  if (sending !== change) return;
  if (change.number !== null) return settle(lastState());
  sending = null; // it was refused, which is told by itself
  send();
}

function settle(state) {
  if (!sending?.number || !state || state.heard < sending.number) return;
  const { number, note } = sending;
  const { command, bad, text } = state.notice ?? {};
  note(command === number && bad ? text : "");
  sending = null;
  send();
}

function letGo() {
  held = null;
  gesture++;
  if (stale) again();
  stale = false;
}

// What is being changed shows what the user wants, and not what the file says yet.
const isBusy = (path) => path === held || [sending, ...waiting.values()].some((change) => change?.field === path);

function showObject(object) {
  // Another may have been asked for since.
  if (asked?.at ? String(object.at) !== String(asked.at) : object.at || object.name !== asked?.name) return;
  if (object.name) asked = { name: object.name, material: object.material };
  if (element("object-name").textContent !== object.name) held = null;
  element("object-name").textContent = object.name;
  element("object-note").textContent = object.gone || object.note || "";
  stale = held !== null; // no control goes or comes while one is moved
  groups = keep(groups, object.groups, ({ name }) => name, groupOf);
  for (const group of object.groups) groups.get(group.name).show(group, object.file);
  if (!stale) place([element("object-groups"), [...groups.values()].map(({ item }) => item)]);
}

// A table: its lines, the values that are there, and those that are not.
function groupOf({ name }) {
  const pre = make("pre", { tabIndex: 0 });
  const kind = new Text();
  const [there, absent] = [make("div"), make("details", { className: "absent" })];
  const count = make("summary");
  const summary = make("summary", {}, make("b", { textContent: name }), kind);
  const item = make("details", { className: "group", open: true }, summary, pre, there, absent);
  item.dataset.name = name;
  let rows = new Map();
  const show = (group, file) => {
    kind.data = group.kind && group.kind !== name ? ` ${group.kind}` : "";
    showLines(pre, group, file);
    rows = keep(rows, group.fields, keyOf, fieldOf);
    for (const field of group.fields) rows.get(keyOf(field)).show(field);
    if (held !== null) return;
    const itemsOf = (isAbsent) => group.fields.filter(({ value }) => (value === undefined) === isAbsent).map((field) => rows.get(keyOf(field)).item);
    const missing = itemsOf(true);
    absent.hidden = !missing.length;
    count.textContent = `${missing.length} not in the file`;
    if (missing.some((row) => row.contains(document.activeElement))) absent.open = true; // it goes there, and stays in sight
    place([there, itemsOf(false)], [absent, [count, ...missing]]);
  };
  return { item, show };
}

// What makes it another control.
const keyOf = ({ path, kind, length, unit, range, gap, squares, fixed, slider, about }) =>
  JSON.stringify([path, kind, length, unit, range, gap, squares, fixed, Boolean(slider), about]);

function showLines(pre, { line, text, more }, file) {
  pre.hidden = !line;
  if (!line) return;
  const lines = text.split("\n");
  const width = String(line + lines.length).length;
  const numbered = lines.map((content, i) => `${String(line + i).padStart(width)}  ${content}`);
  if (more) numbered.push(`${" ".repeat(width)}  … ${more} more lines`);
  pre.textContent = numbered.join("\n");
  pre.setAttribute("aria-label", `${file}, from line ${line}`);
}

// One value: its name, its controls, and what was wrong with the last change.
function fieldOf(field) {
  const error = make("p", { className: "bad", hidden: true });
  error.setAttribute("role", "alert");
  const title = make("span", { className: "name", textContent: field.name, title: field.about });
  const unit = make("small", { textContent: field.unit && field.unit !== "linear" ? field.unit : "" });
  const origin = make("small"); // of what is not in the file
  const out = make("button", { type: "button", textContent: "default", title: `Takes ${field.name} out of the file` });
  const head = make("div", { className: "head" }, title, unit, origin, out);
  const item = make("div", { className: "field", role: "group" }, head);
  item.dataset.path = field.path;
  item.setAttribute("aria-label", field.unit ? `${field.name}, ${field.unit}` : field.name);
  const note = (text) => {
    error.textContent = text;
    error.hidden = !text;
    item.classList.toggle("invalid", Boolean(text));
  };
  let newest = field;
  const change = (value, i) => write(newest, value, i, note);
  const made = { number: numberOf, whole: numberOf, color: colorsOf, vector: vectorOf, choice: choiceOf, switch: switchOf, text: textOf }[field.kind](field, change);
  if (field.fixed) {
    head.append(make("small", { className: "fixed", textContent: field.fixed }));
    for (const input of made.inputs) input.disabled = true;
  }
  out.addEventListener("click", () => {
    if (out.matches(":focus-visible")) made.inputs[0].focus(); // the button goes
    change(null);
    letGo();
  });
  made.inputs.forEach((input, i) => {
    input.dataset.control = `${field.path} ${i}`;
    if (input.matches("[type=range], [type=number]")) {
      input.addEventListener("pointerdown", () => {
        held = field.path;
        pointer = true;
      });
    }
    // A key that is held down is one gesture, like a drag.
    input.addEventListener("keydown", (event) => {
      if (!MOVING.test(event.key)) return;
      held = field.path;
      key = true;
    });
    input.addEventListener("keyup", () => {
      key = false;
      if (!pointer) letGo();
    });
    input.addEventListener("change", () => key || letGo());
    input.addEventListener("blur", () => {
      key = false;
      if (held === field.path) letGo();
    });
  });
  item.append(...made.elements, error);
  let isNew = true;
  const show = (next) => {
    newest = next;
    const isAbsent = next.value === undefined;
    origin.textContent = !isAbsent || next.fixed ? "" : next.default === undefined ? "absent" : "default";
    origin.hidden = !origin.textContent;
    out.hidden = isAbsent || next.required || Boolean(next.fixed);
    if (isBusy(next.path) && !isNew) return;
    isNew = false;
    note(""); // it was about another value
    made.update(next);
  };
  return { item, show };
}

const valueOf = (field) => field.value ?? field.default;

function numberBox(field, label) {
  const box = make("input", { type: "number", step: field.kind === "whole" ? "1" : "any" });
  if (field.range) [box.min, box.max] = field.range.map(say);
  box.setAttribute("aria-label", label);
  box.inputMode = "decimal";
  return box;
}

// A box, and a slider beside it if there is one, for a number of a field.
function pairOf(field, label, slider, change) {
  const box = numberBox(field, label);
  let now;
  const range = slider ? make("input", { type: "range" }) : null;
  // Of squares it goes over the roots.
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
      held = field.path;
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
  const picker = make("input", { type: "color", title: "As a display shows it (sRGB)" });
  picker.setAttribute("aria-label", `${field.name}, as a display shows it (sRGB)`);
  let now = [0, 0, 0];
  let tint = [1, 1, 1]; // the colour at strength 1: it stays when the strength is 0
  const take = (list) => {
    now = list;
    const most = Math.max(...now);
    if (most > 0) tint = now.map((x) => x / most);
  };
  picker.addEventListener("input", () => {
    held = field.path;
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
  // Light has no natural end: one slider makes it stronger and weaker, and the tint stays.
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
    legend.textContent = most > 1 ? `sRGB of the colour over ${digits(most, 4)}; linear red, green, blue` : "sRGB; linear red, green, blue";
  };
  const elements = [make("div", { className: "color" }, picker, ...parts.inputs), legend];
  if (strength) elements.push(make("small", { className: "strength", textContent: "strength, the largest of them" }), strength.element);
  return { inputs: [picker, ...parts.inputs, ...(strength?.inputs ?? [])], elements, update };
}

// Number boxes for a list: `change(list, i)` takes it with another number at a place.
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
