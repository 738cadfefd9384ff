// The page: what the server tells is shown, what the user does is sent.

import { Picture } from "/picture.js";

const element = (id) => document.getElementById(id);
const RETRY = 500; // milliseconds
let socket = null;
let state = null;
let [received, drawn] = [0, 0]; // numbers of frames, so that a late one is not drawn over a newer
let pixelAsked = null; // the pixel that an answer is waited for
let pixelWanted = null;
let noticesSeen = null;
let numberShown = 0; // the number of the frame on the screen
let [unanswered, asked] = [0, 0]; // commands that have no number yet, and the number of the last that has

function ask(command) {
  if (socket?.readyState !== WebSocket.OPEN) return;
  if (!command.pixel) unanswered++;
  socket.send(JSON.stringify(command));
}

// Whether the program has followed all that was asked for here.
const isHeard = () => unanswered === 0 && state !== null && state.heard >= asked;

const picture = new Picture([...document.querySelectorAll("#panels figure")], ask, readPixel, (fits, scale) => {
  const percent = `${Math.round(scale * 100)} %`;
  element("zoom").textContent = fits ? `fit, ${percent}` : percent;
});
picture.tool = () => document.querySelector("input[name=tool]:checked").value;

function connect() {
  socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/socket`);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => {
    showLink("live", "live");
    [pixelAsked, noticesSeen] = [null, null];
    [unanswered, asked, numberShown] = [0, 0, 0];
  };
  socket.onmessage = ({ data }) => (typeof data === "string" ? hear(JSON.parse(data)) : showFrame(data));
  socket.onclose = () => {
    showLink("lost", "connection lost, trying again");
    setTimeout(connect, RETRY);
  };
}

function hear(message) {
  if (message.state) showState(message.state);
  else if (message.pixel) showPixel(message.pixel);
  else if (message.asked || message.refused) {
    unanswered--;
    asked = message.asked ?? asked;
    if (message.refused) showNotice(message.refused, true);
    if (isHeard()) showChoices(state);
  }
}

// A frame: the length of its header, the header as JSON, and the PNG files that it counts.
async function showFrame(data) {
  const number = ++received;
  const length = new DataView(data).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
  let at = 4 + length;
  const decoded = header.parts.map(async ([name, size]) => {
    const blob = new Blob([new Uint8Array(data, at, size)], { type: "image/png" });
    at += size;
    return [name, await createImageBitmap(blob, { colorSpaceConversion: "none" })];
  });
  const images = new Map(await Promise.all(decoded));
  if (number < drawn) return;
  drawn = number;
  const first = !picture.header;
  element("waiting").hidden = true;
  picture.show(header, images);
  if (first && state) showProblems(state.problems);
  showProgress(header);
  readPixel(picture.cursor);
  numberShown = header.number;
  // For whoever wants to know by script what is on the screen.
  Object.assign(element("panels").dataset, {
    revision: header.revision, view: header.view, samples: header.samples, done: header.done,
  });
}

// Whether all that was asked for here, and so many commands of anybody, is on the screen, and nothing more will come of
// it. For whoever drives the page by script.
window.isSettled = (commands) =>
  isHeard() && state.heard >= commands && picture.isSettled() && !state.busy && state.frame > 0 &&
  numberShown >= state.frame;

function showProgress(header) {
  const { samples, total, done, speed, differing, view } = header;
  const counts = ["color", "samples", "compare"].includes(view);
  element("bar").value = !counts ? 1 : total ? samples / total : 0;
  element("samples").textContent = counts ? `${samples} of ${total}` : "1 ray a pixel";
  element("speed").textContent = counts && speed ? withPrefix(speed) : "–";
  element("size").textContent = `${header.width} × ${header.height}`;
  const [shownWidth, shownHeight] = header.finest;
  element("smaller").parentElement.hidden = shownWidth === header.width && shownHeight === header.height;
  element("smaller").textContent = `${shownWidth} × ${shownHeight}; wgray render makes the whole one`;
  showFaults(header);
  if (header.latency !== null) element("latency").textContent = seconds(header.latency);
  const verdict = element("differing");
  if (differing) {
    const [pixels, largest] = differing;
    const at = done ? "" : ` so far`;
    verdict.className = pixels ? "differ" : "same";
    verdict.textContent = pixels
      ? `${pixels.toLocaleString("en")} ${pixels === 1 ? "pixel differs" : "pixels differ"}${at}, ${
        largest === null ? "some by no finite number" : `by ${largest.toPrecision(3)} at most`}`
      : `0 pixels differ${at}: all bits are the same`;
  } else if (view === "compare") {
    verdict.className = "";
    verdict.textContent = "rendering on both";
  }
}

// Pixels that are no light, "GPU: 3 pixels are NaN, 1 infinite"; rings lead to them.
function showFaults({ faults, width, height, sent }) {
  const names = { picture: "", gpu: "GPU: ", cpu: "CPU: " };
  const told = faults.map(([part, found]) => {
    const counts = ["nan", "infinite", "negative"].filter((kind) => found[kind]).map((kind) => {
      return `${found[kind].toLocaleString("en")} ${kind === "nan" ? "NaN" : kind}`;
    });
    return counts.length ? `${names[part]}${counts.join(", ")}` : "";
  }).filter(Boolean);
  element("faults").hidden = !told.length;
  const all = (width / sent[0]) * (height / sent[1]) > 1.5 ? "Pixels so far" : "Pixels";
  element("fault-counts").textContent = told.length ? `${all} that are no light: ${told.join("; ")}` : "";
}

function showState(next) {
  state = next;
  element("panels").dataset.heard = next.heard;
  document.title = `${next.problems.length ? "✗ " : ""}${next.scene} – wgray`;
  element("scene").textContent = next.scene;
  element("device").textContent = next.device;
  element("shaders").textContent = next.shaders ?? "those in the program";
  element("compile").textContent = next.compiling
    ? "compiling" : next.compile_seconds === null ? "–" : seconds(next.compile_seconds);
  element("camera-text").textContent = next.camera;
  element("moved").hidden = !next.camera_moved;
  element("save").disabled = element("reset").disabled = !next.camera_moved;
  element("compare").hidden = next.view !== "compare";
  element("undo").hidden = !next.can_undo;
  picture.marks = next.marks;
  element("gain-shown").textContent = `× ${next.gain}`;
  // What is older than a choice must not undo it.
  if (isHeard()) showChoices(next);
  showProblems(next.problems);
  const { number = 0, text, bad } = next.notice ?? {};
  if (noticesSeen !== null && number > noticesSeen) showNotice(text, bad);
  noticesSeen = number;
}

function showChoices({ view, gain, marks }) {
  for (const input of document.querySelectorAll("input[name=view]")) input.checked = input.value === view;
  element("gain").value = gain;
  element("marks").checked = marks;
}

let problemsShown = "";
function showProblems(problems) {
  // What is read or selected stays as it is.
  const all = JSON.stringify([problems, Boolean(picture.header)]);
  if (all === problemsShown) return;
  problemsShown = all;
  const make = (tag, text) => Object.assign(document.createElement(tag), { textContent: text });
  const articles = problems.map((problem) => {
    const article = document.createElement("article");
    article.append(make("h2", problem.place ?? problem.kind), make("p", problem.message));
    if (problem.excerpt) article.append(make("pre", problem.excerpt));
    const stays = picture.header ? "; the picture is the last good one" : "";
    article.append(make("small", `${problem.kind} error${stays}`));
    return article;
  });
  element("problems").replaceChildren(...articles);
}

let noticeTimer = 0;
function showNotice(text, bad) {
  const notice = element("notice");
  notice.textContent = text;
  notice.classList.toggle("bad", Boolean(bad));
  notice.hidden = false;
  clearTimeout(noticeTimer);
  noticeTimer = setTimeout(() => (notice.hidden = true), bad ? 8000 : 3000);
}

function showLink(kind, text) {
  element("link").className = kind;
  element("link").textContent = text;
}

// One question at a time: the next waits for the answer.
function readPixel(pixel) {
  pixelWanted = pixel;
  if (!pixel) {
    element("swatch").hidden = true;
    element("values").textContent = "Point at a pixel to read its value";
  } else if (!pixelAsked && socket?.readyState === WebSocket.OPEN) {
    pixelAsked = pixel;
    ask({ pixel });
  }
}

function showPixel({ x, y, values }) {
  const asked = pixelAsked;
  pixelAsked = null;
  if (String(pixelWanted) !== String(asked)) return readPixel(pixelWanted);
  const bold = (text) => Object.assign(document.createElement("b"), { textContent: text });
  const parts = [bold("pixel "), `${x} ${y}`];
  for (const [name, value] of values) parts.push(bold(`   ${name} `), value);
  element("values").replaceChildren(...parts);
  const shown = values.find(([name]) => name === "shown")?.[1];
  element("swatch").hidden = !shown;
  if (shown) element("swatch").style.background = `rgb(${shown})`;
}

function withPrefix(n) {
  const [divisor, prefix] = n >= 1e9 ? [1e9, " G"] : n >= 1e6 ? [1e6, " M"] : n >= 1e3 ? [1e3, " k"] : [1, ""];
  return (n / divisor).toPrecision(3) + prefix;
}

function seconds(s) {
  return s < 1 ? `${Math.round(s * 1000)} ms` : `${s.toFixed(2)} s`;
}

async function copyCamera() {
  try {
    await navigator.clipboard.writeText(state.camera);
    showNotice("camera copied");
  } catch {
    // Without a secure connection there is no clipboard: the text is selected for the user to copy.
    getSelection().selectAllChildren(element("camera-text"));
    showNotice("selected: press Ctrl+C to copy");
  }
}

const choose = (name, value) => {
  const input = document.querySelector(`input[name=${name}][value=${value}]`);
  input.checked = true;
  input.dispatchEvent(new Event("change", { bubbles: true }));
};

element("views").addEventListener("change", (event) => ask({ view: event.target.value }));
element("gain").addEventListener("change", (event) => ask({ gain: Number(event.target.value) }));
element("marks").addEventListener("change", (event) => ask({ marks: event.target.checked }));
element("undo").addEventListener("click", () => ask("undo_save"));
element("copy").addEventListener("click", copyCamera);
element("save").addEventListener("click", () => ask("save_camera"));
element("reset").addEventListener("click", () => ask("reset_camera"));
element("zoom-in").addEventListener("click", () => picture.zoom(1.5));
element("zoom-out").addEventListener("click", () => picture.zoom(1 / 1.5));
element("zoom-one").addEventListener("click", () => picture.zoomTo(1));
element("zoom-fit").addEventListener("click", () => picture.fit());

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.target.matches("select")) return;
  const views = ["color", "normal", "depth", "uv", "primitive", "samples", "compare"];
  const tools = { o: "orbit", p: "pan", d: "dolly", h: "hand" };
  const actions = {
    c: copyCamera,
    r: () => ask("reset_camera"),
    0: () => picture.fit(),
    "+": () => picture.zoom(1.25),
    "-": () => picture.zoom(1 / 1.25),
  };
  if (tools[event.key]) choose("tool", tools[event.key]);
  else if (actions[event.key]) actions[event.key]();
  else if (views[event.key - 1]) choose("view", views[event.key - 1]);
});

connect();
