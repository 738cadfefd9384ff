// The selected object: its lines in the scene file, and controls that write its values to the file.

import { controlOf, valueOf } from "/controls.js";
import { ask, element, lastState, onLink, onMessage, onState, put } from "/link.js";
import { enable, keep, make, place } from "/parts.js";

const MOVING = /^(Arrow|Page|Home$|End$)/; // keys that change a control's value
const TYPED = 250; // milliseconds after the last key before matching names are requested

let asked = null; // the request for the shown object: a pixel, or a name and a material
let scenes = null; // the scene's number when `asked` was sent
let shown = null; // the last answer about the object
let groups = new Map(); // the tables that are shown, by name
let gesture = Math.floor(Math.random() * 2 ** 40); // number of the current gesture, whose changes form one undo step
let held = null; // the path of the value whose control is held
let [pointer, key] = [false, false]; // whether a pointer or a key holds it
let stale = false; // whether the tables must be rebuilt when the control is released
let sending = null; // the change that awaits the program's answer
let waiting = new Map(); // later changes: the newest per value and gesture

// Selects the object at a pixel of the image.
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

// Repeats the last request.
function again() {
  if (asked?.at) put({ object: asked.at });
  else if (asked) inspect(asked.name, asked.material);
}

export function setUpObject() {
  setUpSearch();
  onMessage("object", showObject);
  element("undo-write").addEventListener("click", () => ask("undo_write"));
  element("redo-write").addEventListener("click", () => ask("redo_write"));
  document.addEventListener("keydown", (event) => {
    const isText = event.target.matches?.("textarea, input:not([type=range], [type=checkbox], [type=radio], [type=color])");
    if (!(event.ctrlKey || event.metaKey) || event.altKey || isText || event.key.toLowerCase() !== "z") return;
    event.preventDefault();
    ask(event.shiftKey ? "redo_write" : "undo_write");
  });
  // A press can end with a click, with a scroll, or outside of the window, even while a key is held.
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
    showUndo(state);
    showNote();
    settle(state);
    if (state.scenes !== scenes) {
      scenes = state.scenes;
      again();
    }
  });
}

function setUpSearch() {
  const find = element("object-find");
  let timer = 0;
  const list = () => put({ objects: find.value });
  find.addEventListener("input", () => {
    clearTimeout(timer);
    const known = [...element("object-names").children].some((option) => option.value === find.value);
    if (known) inspect(find.value);
    else timer = setTimeout(list, TYPED);
  });
  find.addEventListener("focus", list);
  find.addEventListener("change", () => find.value && inspect(find.value));
  onMessage("objects", ({ objects, more }) => {
    const options = objects.map(([value, label]) => make("option", { value, label }));
    element("object-names").replaceChildren(...options);
    element("object-more").textContent = more ? `${more.toLocaleString("en")} more: type part of the name` : "";
  });
}

// If another program changes the file, the undo history is cleared, and the tooltips of the buttons give the reason.
function showUndo({ undo, redo, undo_blocked }) {
  for (const [id, what, word, keys] of [["undo-write", undo, "Undo", "Ctrl+Z"], ["redo-write", redo, "Redo", "Ctrl+Shift+Z"]]) {
    const button = element(id);
    enable(button, Boolean(what));
    button.textContent = what ? `${word} ${what}` : word;
    button.title = what ? `${word} ${what} (${keys})` : undo_blocked?.replace("Undo", word) ?? `Nothing to ${word.toLowerCase()}`;
  }
}

// Writes a value, or only element `i` of a list, so that changes of other elements by other viewers are kept. The next
// change is sent after the previous change was executed, so that a slider never gets ahead of the file.
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
  sending = null; // refused; a notice shows why
  send();
}

function settle(state) {
  if (!sending?.number || !state || state.executed < sending.number) return;
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

// While a value is being changed, its control shows the user's value instead of the value in the file.
const isBusy = (path) => path === held || [sending, ...waiting.values()].some((change) => change?.field === path);

function showObject(object) {
  // The answer may belong to an earlier request.
  if (asked?.at ? String(object.at) !== String(asked.at) : object.at || object.name !== asked?.name) return;
  if (object.name) asked = { name: object.name, material: object.material };
  if (element("object-name").textContent !== object.name) held = null;
  element("object-name").textContent = object.name;
  shown = object;
  showNote();
  stale = held !== null; // controls are not added or removed while one is held
  groups = keep(groups, object.groups, ({ name }) => name, groupOf);
  for (const group of object.groups) groups.get(group.name).show(group, object.file);
  if (!stale) place([element("object-groups"), [...groups.values()].map(({ item }) => item)]);
}

function showNote() {
  const isMoved = shown?.name === "camera" && !shown.gone && lastState()?.camera_moved;
  const moved = "The view has moved. The file keeps these values until you press Save to scene.";
  const text = shown?.gone || shown?.note || (isMoved ? moved : "");
  if (element("object-note").textContent !== text) element("object-note").textContent = text;
}

// A table of the scene file: its source lines, the values in the file, and the values that have their defaults.
function groupOf({ name }) {
  const pre = make("pre", { tabIndex: 0 });
  const kind = new Text();
  const [present, absent] = [make("div"), make("details", { className: "absent" })];
  const count = make("summary");
  const summary = make("summary", {}, make("b", { textContent: name }), kind);
  const item = make("details", { className: "group", open: true }, summary, pre, present, absent);
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
    count.textContent = missing.length === 1 ? "1 default" : `${missing.length} defaults`;
    if (missing.some((row) => row.contains(document.activeElement))) absent.open = true; // the focus moves there
    place([present, itemsOf(false)], [absent, [count, ...missing]]);
  };
  return { item, show };
}

// Fields with the same key can share a control.
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

// A value: its name, its controls, and the error of its last change.
function fieldOf(field) {
  const error = make("p", { className: "bad", hidden: true });
  error.setAttribute("role", "alert");
  const title = make("span", { className: "name", textContent: field.name, title: field.about });
  const unit = make("small", { textContent: field.unit && field.unit !== "linear" ? field.unit : "" });
  const origin = make("small");
  const out = make("button", { type: "button", textContent: "default" });
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
  let accepted = field.value;
  let kept = null; // the value in the file while the error of a refused value is shown
  const change = (value, i) =>
    write(newest, value, i, (text) => {
      if (text) kept = JSON.stringify(accepted);
      else accepted = value;
      note(text);
    });
  const made = controlOf(field, change);
  if (field.fixed) {
    head.append(make("small", { className: "fixed", textContent: field.fixed }));
    for (const input of made.inputs) input.disabled = true;
  }
  out.addEventListener("click", () => {
    if (out.matches(":focus-visible")) made.inputs[0].focus(); // the button disappears
    change(null);
    letGo();
  });
  made.inputs.forEach((input, i) => {
    input.dataset.control = `${field.path} ${i}`;
    hold(input, field.path);
  });
  item.append(...made.elements, error);
  let isNew = true;
  const show = (next) => {
    const before = newest.value;
    newest = next;
    const isAbsent = next.value === undefined;
    origin.textContent = !isAbsent || next.fixed ? "" : next.default === undefined ? "absent" : "default";
    origin.hidden = !origin.textContent;
    out.title = next.default === undefined ? `Remove ${next.name} from the file` : `Remove ${next.name} from the file and use the default`;
    out.hidden = isAbsent || next.required || Boolean(next.fixed);
    if (isBusy(next.path) && !isNew) return;
    isNew = false;
    // A late answer to an earlier change does not replace the error and the refused value.
    const isLate = !error.hidden && JSON.stringify(next.value) === kept && JSON.stringify(before) !== kept;
    if (isLate) return;
    accepted = next.value;
    note(""); // the error was about an earlier value
    made.update(next);
  };
  return { item, show };
}

// Tracks whether an input is being moved. A drag or a held key is one gesture.
function hold(input, path) {
  if (input.matches("[type=range], [type=number]")) {
    input.addEventListener("pointerdown", () => {
      held = path;
      pointer = true;
    });
  }
  if (input.matches("[type=range], [type=color]")) input.addEventListener("input", () => (held = path), true);
  input.addEventListener("keydown", (event) => {
    if (!MOVING.test(event.key)) return;
    held = path;
    key = true;
  });
  input.addEventListener("keyup", () => {
    key = false;
    if (!pointer) letGo();
  });
  input.addEventListener("change", () => key || letGo());
  input.addEventListener("blur", () => {
    key = false;
    if (held === path) letGo();
  });
}
