// What is shown of the scene, and how: the toolbar's views, exposure, view transform, false colours, the histogram.

import { ask, element, onFrame, onState } from "/link.js";
import { numberField } from "/numbers.js";

const VIEWS = ["color", "normal", "depth", "uv", "primitive", "samples", "compare"];
const radios = () => [...document.querySelectorAll("input[name=view]")];
const STOPS = { kind: "number", range: [-100, 100] };
let stops = 0; // of exposure
let showStops = null; // in their box
let choice = { exposure: null, transform: null, false_color: false };

// The name of a view as the program tells it: "normal", or {"compare": "cpu"}.
export const viewName = (view) => (typeof view === "string" ? view : Object.keys(view)[0]);

export function setUpView(picture, onKey) {
  element("views").addEventListener("change", ({ target }) => choose(target.value));
  element("layers").addEventListener("change", ({ target }) => {
    if (target.value.startsWith("layer:")) ask({ view: { layer: target.value.slice(6) } });
    else choose(target.value || "color");
  });
  VIEWS.forEach((view, i) => onKey(String(i + 1), () => choose(view)));
  element("zoom-in").addEventListener("click", () => picture.zoom(1.5));
  element("zoom-out").addEventListener("click", () => picture.zoom(1 / 1.5));
  element("zoom-one").addEventListener("click", () => picture.zoomTo(1));
  element("zoom-fit").addEventListener("click", () => picture.fit());
  onKey("+", () => picture.zoom(1.25));
  onKey("-", () => picture.zoom(1 / 1.25));
  onKey("0", () => picture.fit());
  picture.zoomed = (fits, scale) => {
    const percent = `${Math.round(scale * 100)} %`;
    element("zoom").textContent = fits ? `fit, ${percent}` : percent;
  };

  const expose = (exposure) => look({ exposure: Math.max(-100, Math.min(100, exposure)) });
  showStops = numberField(element("exposure-number"), STOPS, () => [stops], expose);
  element("exposure").addEventListener("input", ({ target }) => {
    showStops(target.valueAsNumber);
    expose(target.valueAsNumber);
  });
  element("transform").addEventListener("change", ({ target }) => look({ transform: target.value }));
  element("false-color").addEventListener("change", ({ target }) => look({ false_color: target.checked }));
  element("as-scene").addEventListener("click", () => look({ exposure: null, transform: null, false_color: false }));
  element("marks").addEventListener("change", ({ target }) => ask({ marks: target.checked }));
  onState(showState);
  onFrame(showFrame);
  new ResizeObserver(() => drawHistogram()).observe(element("histogram"));
}

// Goes over to a view; that of the comparison is with what is chosen there.
export function choose(view) {
  const against = document.querySelector("input[name=against]:checked").value;
  for (const radio of radios()) radio.checked = radio.value === view;
  if (view === "compare") element("compare").open = true;
  ask({ view: view === "compare" ? { compare: against } : view });
}

function look(change) {
  choice = { ...choice, ...change };
  ask({ look: choice });
}

function showState(state, heard) {
  if (!heard) return;
  const name = viewName(state.view);
  for (const radio of radios()) radio.checked = radio.value === name;
  showLayers(state.layers ?? []);
  showMissing(Object.fromEntries(state.missing_views));
  const layers = element("layers");
  layers.value = name === "layer" ? `layer:${state.view.layer}` : name;
  if (layers.selectedIndex < 0) layers.value = "";
  const chosen = layers.value !== "";
  if (chosen && !layers.classList.contains("chosen")) {
    const bar = element("toolbar"); // on a narrow screen the list may lie beyond its end
    bar.scrollLeft = Math.max(bar.scrollLeft, layers.offsetLeft + layers.offsetWidth - bar.clientWidth);
  }
  layers.classList.toggle("chosen", chosen);

  choice = state.look;
  const [exposure, transform] = state.scene_look;
  stops = choice.exposure ?? exposure;
  element("exposure").value = stops;
  showStops(stops);
  element("transform").value = choice.transform ?? transform;
  element("false-color").checked = choice.false_color;
  element("as-scene").disabled = choice.exposure === null && choice.transform === null && !choice.false_color;
  element("marks").checked = state.marks;
}

// The layers that shaders write.
let layersShown = "";
function showLayers(names) {
  if (String(names) === layersShown) return;
  layersShown = String(names);
  const group = element("layers").querySelector("optgroup:last-of-type");
  group.replaceChildren(...names.map((name) => new Option(name, `layer:${name}`)));
  group.hidden = !names.length;
}

// Views that the scene does not have are off, and their group says why.
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

function showFrame(header) {
  drawHistogram(header);
  showLegend(header.legend);
  showFaults(header);
}

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
  const light = (stops) => `2^${Number(stops.toFixed(1))}`;
  [...element("legend").querySelectorAll("span")].forEach((span, i) => {
    span.textContent = light(first + ((last - first) * i) / 2);
  });
}

// How many pixels have which value, in stops; what the exposure takes above 1 is to the right of the line.
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
  const most = Math.sqrt(Math.max(1, ...counts.flat()));
  const x = (bin) => (bin / bins) * canvas.width;
  const isDark = matchMedia("(prefers-color-scheme: dark)").matches;
  context.globalCompositeOperation = isDark ? "lighter" : "multiply";
  const colors = isDark ? ["#c22", "#2a2", "#24d"] : ["#f77", "#6c6", "#79f"];
  counts.forEach((channel, i) => {
    context.fillStyle = colors[i];
    channel.forEach((count, bin) => {
      const height = (Math.sqrt(count) / most) * canvas.height;
      context.fillRect(x(bin), canvas.height - height, x(bin + 1) - x(bin), height);
    });
  });
  const white = (-stops - first) * of_a_stop;
  context.globalCompositeOperation = "source-over";
  context.fillStyle = style.color;
  context.fillRect(Math.round(x(white)), 0, Math.max(1, ratio), canvas.height);
  const above = Math.max(...above_white) / Math.max(1, header.sent[0] * header.sent[1]);
  const stop = (bin) => `2^${first + Math.floor(bin / of_a_stop)}`;
  const seen = counts[0].map((_, bin) => counts.some((channel) => channel[bin] > 0));
  const [low, high] = [seen.indexOf(true), seen.lastIndexOf(true)];
  const range = low < 0 ? "no light" : `light from ${stop(low)} to ${stop(high + of_a_stop)}`;
  text.textContent = `${range}; ${(100 * above).toFixed(1)} % above white`;
  canvas.setAttribute("aria-label", `Histogram: ${text.textContent}`);
}

// Pixels that are no light, "first: 3 NaN, 1 infinite"; rings lead to them.
function showFaults({ faults, width, height, sent, sides }) {
  const names = { picture: "", first: `${sides?.[0] ?? "first"}: `, second: `${sides?.[1] ?? "second"}: ` };
  const told = faults.map(([part, found]) => {
    const counts = ["nan", "infinite", "negative"].filter((kind) => found[kind]).map((kind) => {
      return `${found[kind].toLocaleString("en")} ${kind === "nan" ? "NaN" : kind}`;
    });
    return counts.length ? `${names[part]}${counts.join(", ")}` : "";
  }).filter(Boolean);
  element("faults").hidden = !told.length;
  const all = (width / sent[0]) * (height / sent[1]) > 1.5 ? "Pixels so far" : "Pixels";
  const text = told.length ? `${all} that are no light: ${told.join("; ")}` : "";
  if (element("fault-counts").textContent !== text) element("fault-counts").textContent = text;
}
