// The selected object: its lines in the scene file, and controls that write its values to the file.

import { makeControl, valueOf } from "/controls.js";
import { element, lastState, onLink, onMessage, onState, sendCommand, sendQuery } from "/link.js";
import { enable, make, reuse, setChildren } from "/parts.js";

const VALUE_KEYS = /^(Arrow|Page|Home$|End$)/; // keys that change a control's value
const SEARCH_DELAY = 250; // milliseconds after the last key before matching names are requested

let request = null; // the request for the shown object: a pixel, or a name and a material
let requestedRevision = null; // the revision of the scene when `request` was sent
let shown = null; // the last answer about the object
let groups = new Map(); // the tables that are shown, by name
let gesture = Math.floor(Math.random() * 2 ** 40); // the current gesture's number; its changes form one undo step
let held = null; // the path of the value whose control is held
let [pointer, key] = [false, false]; // whether a pointer or a key holds the control
let stale = false; // whether the tables must be rebuilt when the control is released
let sending = null; // the change that awaits the program's answer
let waiting = new Map(); // later changes: the newest per value and gesture

// Selects the object at a pixel of the image.
export function select(pixel) {
  request = { at: pixel };
  element("object").open = true;
  requestedRevision = lastState()?.scene_revision;
  sendQuery({ object: pixel });
}

function inspect(name, material) {
  request = { name, material };
  requestedRevision = lastState()?.scene_revision;
  sendQuery({ inspect: request });
}

// Repeats the last request.
function repeatRequest() {
  if (request?.at) sendQuery({ object: request.at });
  else if (request) inspect(request.name, request.material);
}

export function setUpObject() {
  setUpSearch();
  onMessage("object", showObject);
  element("undo-write").addEventListener("click", () => sendCommand("undo_write"));
  element("redo-write").addEventListener("click", () => sendCommand("redo_write"));
  document.addEventListener("keydown", (event) => {
    const isText = event.target.matches?.("textarea, input:not([type=range], [type=checkbox], [type=radio], [type=color])");
    if (!(event.ctrlKey || event.metaKey) || event.altKey || isText || event.key.toLowerCase() !== "z") return;
    event.preventDefault();
    sendCommand(event.shiftKey ? "redo_write" : "undo_write");
  });
  // A press can end with a click, with a scroll, or outside of the window, even while a key is held.
  for (const end of ["pointerup", "pointercancel", "blur"]) {
    window.addEventListener(end, () => setTimeout(() => {
      if (pointer && !key) release();
      pointer = false;
    }));
  }
  onLink(() => {
    requestedRevision = null;
    [sending, waiting] = [null, new Map()];
  });
  onState((state) => {
    showUndo(state);
    showNote();
    settle(state);
    if (state.scene_revision !== requestedRevision) {
      requestedRevision = state.scene_revision;
      repeatRequest();
    }
  });
}

function setUpSearch() {
  const searchBox = element("object-find");
  let timer = 0;
  const queryNames = () => sendQuery({ objects: searchBox.value });
  searchBox.addEventListener("input", () => {
    clearTimeout(timer);
    const isListed = [...element("object-names").children].some((option) => option.value === searchBox.value);
    if (isListed) inspect(searchBox.value);
    else timer = setTimeout(queryNames, SEARCH_DELAY);
  });
  searchBox.addEventListener("focus", queryNames);
  searchBox.addEventListener("change", () => searchBox.value && inspect(searchBox.value));
  onMessage("objects", ({ objects, more }) => {
    const options = objects.map(([value, label]) => make("option", { value, label }));
    element("object-names").replaceChildren(...options);
    element("object-more").textContent = more ? `${more.toLocaleString("en")} more: type part of the name` : "";
  });
}

// Shows what the undo and redo buttons change, or why nothing can be undone.
function showUndo({ undo, redo, undo_blocked }) {
  for (const [id, changed, word, keys] of [["undo-write", undo, "Undo", "Ctrl+Z"], ["redo-write", redo, "Redo", "Ctrl+Shift+Z"]]) {
    const button = element(id);
    enable(button, Boolean(changed));
    button.textContent = changed ? `${word} ${changed}` : word;
    button.title = changed ? `${word} ${changed} (${keys})` : undo_blocked?.replace("Undo", word) ?? `Nothing to ${word.toLowerCase()}`;
  }
}

// Writes a value, or only element `i` of a list, so that changes of other elements by other viewers are kept. The next
// change is sent after the previous change was executed, so that a slider never gets ahead of the file.
function write(field, value, i, note) {
  const isElement = i !== undefined && valueOf(field) !== undefined;
  const set = { path: isElement ? `${field.path}[${i}]` : field.path, value: isElement ? value[i] : value, gesture };
  waiting.set(`${set.path} ${gesture}`, { field: field.path, set, note, number: null });
  if (!sending) send();
}

async function send() {
  const [first] = waiting;
  if (!first) return;
  const [key, change] = first;
  waiting.delete(key);
  sending = change;
  change.number = await sendCommand({ set: change.set });
  if (sending !== change) return;
  if (change.number !== null) return settle(lastState());
  sending = null; // the change is refused, and a notice shows the reason
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

function release() {
  held = null;
  gesture++;
  if (stale) repeatRequest();
  stale = false;
}

// Returns true if a value is being changed. Its control then shows the user's value instead of the value in the file.
const isBusy = (path) => path === held || [sending, ...waiting.values()].some((change) => change?.field === path);

function showObject(object) {
  // The answer may belong to an earlier request.
  if (request?.at ? String(object.at) !== String(request.at) : object.at || object.name !== request?.name) return;
  if (object.name) request = { name: object.name, material: object.material };
  if (element("object-name").textContent !== object.name) held = null;
  element("object-name").textContent = object.name;
  shown = object;
  showNote();
  stale = held !== null; // while a control is held, no controls are added or removed
  groups = reuse(groups, object.groups, ({ name }) => name, makeGroup);
  for (const group of object.groups) groups.get(group.name).show(group, object.file);
  if (!stale) setChildren([element("object-groups"), [...groups.values()].map(({ item }) => item)]);
}

function showNote() {
  const isMoved = shown?.name === "camera" && !shown.gone && lastState()?.camera_moved;
  const moved = "The view has moved. The file keeps these values until you press Save to scene.";
  const text = shown?.gone || shown?.note || (isMoved ? moved : "");
  if (element("object-note").textContent !== text) element("object-note").textContent = text;
}

// Creates the view of a table of the scene file: source lines, the keys in the file, and the keys that the file omits.
function makeGroup({ name }) {
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
    rows = reuse(rows, group.fields, keyOf, makeField);
    for (const field of group.fields) rows.get(keyOf(field)).show(field);
    if (held !== null) return;
    const itemsOf = (isAbsent) => group.fields.filter(({ value }) => (value === undefined) === isAbsent).map((field) => rows.get(keyOf(field)).item);
    const missing = itemsOf(true);
    absent.hidden = !missing.length;
    count.textContent = missing.length === 1 ? "1 default" : `${missing.length} defaults`;
    if (missing.some((row) => row.contains(document.activeElement))) absent.open = true; // keeps the focus visible
    setChildren([present, itemsOf(false)], [absent, [count, ...missing]]);
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
  if (more) numbered.push(`${" ".repeat(width)}  … (lines omitted: ${more})`);
  pre.textContent = numbered.join("\n");
  pre.setAttribute("aria-label", `${file}, from line ${line}`);
}

// A value: its name, its controls, and the error of its last change.
function makeField(field) {
  const error = make("p", { className: "bad", hidden: true });
  error.setAttribute("role", "alert");
  const title = make("span", { className: "name", textContent: field.name, title: field.about });
  const unit = make("small", { textContent: field.unit && field.unit !== "linear" ? field.unit : "" });
  const origin = make("small");
  const remove = make("button", { type: "button", textContent: "default" });
  const head = make("div", { className: "head" }, title, unit, origin, remove);
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
  let valueInFile = null; // the value in the file while the error of a refused value is shown
  const change = (value, i) =>
    write(newest, value, i, (text) => {
      if (text) valueInFile = JSON.stringify(accepted);
      else accepted = value;
      note(text);
    });
  const control = makeControl(field, change);
  if (field.fixed) {
    head.append(make("small", { className: "fixed", textContent: field.fixed }));
    for (const input of control.inputs) input.disabled = true;
  }
  remove.addEventListener("click", () => {
    if (remove.matches(":focus-visible")) control.inputs[0].focus(); // the button disappears
    change(null);
    release();
  });
  control.inputs.forEach((input, i) => {
    input.dataset.control = `${field.path} ${i}`;
    hold(input, field.path);
  });
  item.append(...control.elements, error);
  let isNew = true;
  const show = (next) => {
    const previous = newest.value;
    newest = next;
    const isAbsent = next.value === undefined;
    origin.textContent = !isAbsent || next.fixed ? "" : next.default === undefined ? "absent" : "default";
    origin.hidden = !origin.textContent;
    remove.title = next.default === undefined ? `Remove ${next.name} from the file` : `Remove ${next.name} from the file and use the default`;
    remove.hidden = isAbsent || next.required || Boolean(next.fixed);
    if (isBusy(next.path) && !isNew) return;
    isNew = false;
    // A late answer to an earlier change does not replace the error and the refused value.
    const isLate = !error.hidden && JSON.stringify(next.value) === valueInFile && JSON.stringify(previous) !== valueInFile;
    if (isLate) return;
    accepted = next.value;
    note(""); // an error would be about an earlier value
    control.update(next);
  };
  return { item, show };
}

// Tracks whether the user is changing an input's value. A drag or a held key is one gesture.
function hold(input, path) {
  if (input.matches("[type=range], [type=number]")) {
    input.addEventListener("pointerdown", () => {
      held = path;
      pointer = true;
    });
  }
  if (input.matches("[type=range], [type=color]")) input.addEventListener("input", () => (held = path), true);
  input.addEventListener("keydown", (event) => {
    if (!VALUE_KEYS.test(event.key)) return;
    held = path;
    key = true;
  });
  input.addEventListener("keyup", () => {
    key = false;
    if (!pointer) release();
  });
  input.addEventListener("change", () => key || release());
  input.addEventListener("blur", () => {
    key = false;
    if (held === path) release();
  });
}
