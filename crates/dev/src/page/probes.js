// The values of the pixel under the pointer and of pinned pixels, with their history.

import { element, onFrame, onLink, queryPixel } from "/link.js";
import { enable } from "/parts.js";

const MAX_PINS = 16;
const MAX_HISTORY = 60; // maximum number of values in the history of a pin
let isReading = false;
let pins = []; // {pixel, history: [{revision, samples, view, values}]}

export function setUpProbes(picture, onKey) {
  picture.pointed = () => read(picture);
  const pin = () => add(picture.cursor, picture);
  onKey("n", pin);
  element("pin").addEventListener("click", pin);
  onLink(() => (isReading = false));
  onFrame((header) => {
    read(picture);
    pins.forEach((pin) => refresh(pin, header));
  });
  showPins(picture);
}

// Reads the pixel under the pointer. At most one request is pending.
async function read(picture) {
  const pixel = picture.cursor;
  enable(element("pin"), Boolean(pixel));
  if (!pixel) {
    element("swatch").hidden = true;
    element("values").textContent = "Point at a pixel to read its value";
    return;
  }
  if (isReading) return;
  isReading = true;
  const answer = await queryPixel(pixel);
  isReading = false;
  if (!answer) return;
  if (String(picture.cursor) !== String(pixel)) return read(picture);
  show(answer, picture.header);
}

const bold = (text) => Object.assign(document.createElement("b"), { textContent: text });

function show({ x, y, values }, header) {
  const parts = [bold("pixel "), `${x} ${y}`];
  for (const [name, value] of values) parts.push(bold(`   ${nameOf(name, header)} `), value);
  element("values").replaceChildren(...parts);
  const shown = values.find(([name]) => name === "shown")?.[1];
  element("swatch").hidden = !shown;
  if (shown) element("swatch").style.background = `rgb(${shown})`;
}

// Returns the caption of a side of a comparison; returns other names unchanged.
const nameOf = (name, header) => ({ first: header?.sides?.[0], second: header?.sides?.[1] })[name] ?? name;

function add(pixel, picture) {
  if (!pixel || pins.length >= MAX_PINS || pins.some((pin) => String(pin.pixel) === String(pixel))) return;
  const pin = { pixel, history: [] };
  pins.push(pin);
  element("probes").open = true;
  showPins(picture);
  refresh(pin, picture.header);
}

async function refresh(pin, { revision, samples, view }) {
  const answer = await queryPixel(pin.pixel);
  if (!answer || !pins.includes(pin)) return;
  // Only the newest value of each revision and view is kept.
  const entry = { revision, samples, view: JSON.stringify(view), values: answer.values };
  const last = pin.history.at(-1);
  if (last && last.revision === revision && last.view === entry.view) pin.history.pop();
  pin.history.push(entry);
  pin.history.splice(0, pin.history.length - MAX_HISTORY);
  showPin(pin);
}

function showPins(picture) {
  element("probe-count").textContent = pins.length || "";
  picture.pins = pins.map(({ pixel }) => pixel);
  element("pins").replaceChildren(...pins.map((pin) => {
    const item = document.createElement("li");
    const remove = Object.assign(document.createElement("button"), { type: "button", textContent: "×" });
    remove.setAttribute("aria-label", `Remove the probe at ${pin.pixel.join(" ")}`);
    remove.addEventListener("click", () => {
      pins = pins.filter((entry) => entry !== pin);
      showPins(picture);
    });
    pin.output = document.createElement("div");
    item.append(bold(pin.pixel.join(" ")), remove, pin.output);
    showPin(pin);
    return item;
  }));
}

// Shows all current values of a pin, the curve of the first value, and the first value's history, newest first.
function showPin(pin) {
  const make = (tag, text) => Object.assign(document.createElement(tag), { textContent: text });
  const newest = pin.history.at(-1);
  if (!newest || !pin.output) return;
  const list = document.createElement("dl");
  for (const [name, value] of newest.values) list.append(make("dt", name), make("dd", value));
  const parts = [list];
  const earlier = pin.history.slice(0, -1).filter(({ view }) => view === newest.view);
  if (earlier.length) {
    const history = document.createElement("details");
    const rows = earlier.reverse().map(({ values, samples }) => make("li", `${values[0]?.[1] ?? "–"} (${samples} samples)`));
    const older = document.createElement("ol");
    older.append(...rows);
    history.append(make("summary", `${earlier.length} earlier ${earlier.length === 1 ? "value" : "values"}`), older);
    history.open = pin.open ?? false;
    history.addEventListener("toggle", () => (pin.open = history.open));
    parts.push(curve([...earlier.reverse(), newest]), history);
  }
  pin.output.replaceChildren(...parts);
}

function curve(entries) {
  const numbers = entries.map(({ values }) => Number.parseFloat(values[0]?.[1])).map((v) => (Number.isFinite(v) ? v : 0));
  const canvas = Object.assign(document.createElement("canvas"), { width: 280, height: 36 });
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", `First value over ${numbers.length} revisions, from ${numbers[0]} to ${numbers.at(-1)}`);
  const context = canvas.getContext("2d");
  const [low, high] = [Math.min(...numbers), Math.max(...numbers)];
  context.strokeStyle = getComputedStyle(document.documentElement).getPropertyValue("--accent");
  context.lineWidth = 2;
  context.beginPath();
  numbers.forEach((v, i) => {
    const x = numbers.length > 1 ? 2 + (276 * i) / (numbers.length - 1) : 140;
    const y = high > low ? 33 - (30 * (v - low)) / (high - low) : 18;
    context.lineTo(x, y);
  });
  context.stroke();
  return canvas;
}
