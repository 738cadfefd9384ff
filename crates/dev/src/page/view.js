// Views and layers, exposure, view transform, false colours and the histogram.

import { element, onFrame, onState, sendCommand } from "/link.js";
import { numberField } from "/numbers.js";
import { enable } from "/parts.js";

const VIEWS = ["color", "normal", "depth", "uv", "primitive", "samples", "compare"];
const radios = () => [...document.querySelectorAll("input[name=view]")];
const MAX_EXPOSURE = 100; // maximum exposure in stops, positive or negative
const EXPOSURE_FIELD = { kind: "number", range: [-MAX_EXPOSURE, MAX_EXPOSURE] };
let stops = 0; // current exposure
let showStops = null; // shows an exposure in its box and slider
let overrides = { exposure: null, transform: null, false_color: false };

// Returns the name of a view: "normal" for "normal", and "compare" for {"compare": "cpu"}.
export const viewName = (view) => (typeof view === "string" ? view : Object.keys(view)[0]);

export function setUpView(picture, onKey, showNotice) {
  element("views").addEventListener("change", ({ target }) => choose(target.value));
  element("layers").addEventListener("change", ({ target }) => choose(target.value || "color"));
  VIEWS.forEach((view, i) => onKey(String(i + 1), () => choose(view)));
  element("zoom-in").addEventListener("click", () => picture.zoom(1.5));
  element("zoom-out").addEventListener("click", () => picture.zoom(1 / 1.5));
  element("zoom-one").addEventListener("click", () => picture.zoomTo(1));
  element("zoom-fit").addEventListener("click", () => picture.fit());
  onKey("+", () => picture.zoom(1.25));
  onKey("-", () => picture.zoom(1 / 1.25));
  onKey("0", () => picture.fit());
  picture.zoomed = (fits, scale) => {
    const percent = `${Math.round(scale * 100)}%`;
    element("zoom").textContent = fits ? `Fit, ${percent}` : percent;
  };

  setUpExposure(showNotice);
  element("transform").addEventListener("change", ({ target }) => setOverrides({ transform: target.value }));
  element("false-color").addEventListener("change", ({ target }) => setOverrides({ false_color: target.checked }));
  element("reset-look").addEventListener("click", () => setOverrides({ exposure: null, transform: null, false_color: false }));
  onState(showState);
  onFrame((header) => {
    drawHistogram(header);
    showLegend(header.legend);
  });
  new ResizeObserver(() => drawHistogram()).observe(element("histogram"));
}

function setUpExposure(showNotice) {
  const slider = element("exposure");
  const setExposure = (requested) => {
    const exposure = Math.max(-MAX_EXPOSURE, Math.min(MAX_EXPOSURE, requested));
    if (exposure === requested) showNotice("");
    else showNotice(`Exposure must be from -${MAX_EXPOSURE} to ${MAX_EXPOSURE} stops: ${requested} became ${exposure}`, true);
    setOverrides({ exposure });
  };
  const showInBox = numberField(element("exposure-number"), EXPOSURE_FIELD, () => [stops], setExposure);
  showStops = (stops) => {
    // The slider has a smaller range than the box until the value is outside the slider's range.
    if (Math.abs(stops) > Number(slider.max)) [slider.min, slider.max] = [-MAX_EXPOSURE, MAX_EXPOSURE];
    slider.value = stops;
    showInBox(stops);
  };
  slider.addEventListener("input", () => {
    showInBox(slider.valueAsNumber);
    setExposure(slider.valueAsNumber);
  });
}

// Switches to a view. A comparison uses the selected second image.
export function choose(view) {
  const against = document.querySelector("input[name=against]:checked").value;
  for (const radio of radios()) radio.checked = radio.value === view;
  if (view === "compare") element("compare").open = true;
  sendCommand({ view: view === "compare" ? { compare: against } : view });
}

function setOverrides(change) {
  overrides = { ...overrides, ...change };
  sendCommand({ look: overrides });
}

function showState(state, isCurrent) {
  if (!isCurrent) return;
  const name = viewName(state.view);
  for (const radio of radios()) radio.checked = radio.value === name;
  showMissing(Object.fromEntries(state.missing_views));
  const layers = element("layers");
  layers.value = name;
  if (layers.selectedIndex < 0) layers.value = "";
  const isLayer = layers.value !== "";
  layers.classList.toggle("chosen", isLayer);
  reveal(isLayer ? layers : document.querySelector("input[name=view]:checked")?.parentElement);

  overrides = state.look;
  const [exposure, transform] = state.scene_look;
  stops = overrides.exposure ?? exposure;
  showStops(stops);
  element("transform").value = overrides.transform ?? transform;
  element("false-color").checked = overrides.false_color;
  enable(element("reset-look"), overrides.exposure !== null || overrides.transform !== null || overrides.false_color);
}

// Scrolls the toolbar of a narrow screen to the button of a newly selected view.
let revealed = null;
function reveal(button) {
  if (!button || button === revealed) return;
  revealed = button;
  const [bar, { offsetLeft, offsetWidth }] = [element("toolbar"), button];
  bar.scrollLeft = Math.min(offsetLeft, Math.max(bar.scrollLeft, offsetLeft + offsetWidth - bar.clientWidth));
}

// Disables views that the scene lacks; the label of the group gives the reason.
let missingShown = "";
function showMissing(rules) {
  if (JSON.stringify(rules) === missingShown) return;
  missingShown = JSON.stringify(rules);
  for (const group of element("layers").querySelectorAll("optgroup")) {
    group.dataset.name ??= group.label;
    for (const option of group.children) {
      option.disabled = option.value in rules;
      option.title = rules[option.value] ?? "";
    }
    const rule = [...group.children].map((option) => option.title).find(Boolean);
    group.label = rule ? `${group.dataset.name}: ${rule}` : group.dataset.name;
  }
}

const SUPERSCRIPTS = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };
const powerOfTwoText = (exponent) =>
  Number.isInteger(exponent) ? `2${[...String(exponent)].map((c) => SUPERSCRIPTS[c]).join("")}` : `2^${exponent}`;

function showLegend(legend) {
  element("legend").hidden = !legend;
  if (!legend) return;
  const canvas = element("legend").querySelector("canvas");
  const context = canvas.getContext("2d");
  legend.colors.forEach((color, i) => {
    context.fillStyle = `rgb(${color})`;
    context.fillRect(i, 0, 1, 1);
  });
  const [first, last] = legend.stops;
  [...element("legend").querySelectorAll("span")].forEach((span, i) => {
    span.textContent = powerOfTwoText(Number((first + ((last - first) * i) / 2).toFixed(1)));
  });
}

// Draws the number of pixels per value; values are in stops. A line marks the value that the exposure maps to 1.
let lastHeader = null;
function drawHistogram(header = lastHeader) {
  lastHeader = header;
  const [canvas, text] = [element("histogram"), element("histogram-text")];
  canvas.hidden = text.hidden = !header?.histogram;
  if (canvas.hidden) return;
  const { first, of_a_stop, counts, above_white } = header.histogram;
  const bins = counts[0].length;
  const ratio = devicePixelRatio;
  [canvas.width, canvas.height] = [canvas.clientWidth, canvas.clientHeight].map((v) => Math.round(v * ratio));
  const context = canvas.getContext("2d");
  const style = getComputedStyle(canvas);
  const maxHeight = Math.sqrt(Math.max(1, ...counts.flat()));
  const x = (bin) => (bin / bins) * canvas.width;
  const isDark = matchMedia("(prefers-color-scheme: dark)").matches;
  context.globalCompositeOperation = isDark ? "lighter" : "multiply";
  const colors = isDark ? ["#c22", "#2a2", "#24d"] : ["#f77", "#6c6", "#79f"];
  counts.forEach((channel, i) => {
    context.fillStyle = colors[i];
    channel.forEach((count, bin) => {
      const height = (Math.sqrt(count) / maxHeight) * canvas.height;
      context.fillRect(x(bin), canvas.height - height, x(bin + 1) - x(bin), height);
    });
  });
  const white = (-stops - first) * of_a_stop;
  context.globalCompositeOperation = "source-over";
  context.fillStyle = style.color;
  context.fillRect(Math.round(x(white)), 0, Math.max(1, ratio), canvas.height);
  const clipped = Math.max(...above_white) / Math.max(1, header.sent[0] * header.sent[1]);
  const stop = (bin) => powerOfTwoText(first + Math.floor(bin / of_a_stop));
  const isUsed = counts[0].map((_, bin) => counts.some((channel) => channel[bin] > 0));
  const [low, high] = [isUsed.indexOf(true), isUsed.lastIndexOf(true)];
  const range = low < 0 ? "No light" : `Range ${stop(low)} to ${stop(high + of_a_stop)}`;
  text.textContent = `${range}; ${(100 * clipped).toFixed(1)}% clipped`;
  canvas.setAttribute("aria-label", `Histogram: ${text.textContent}`);
}
