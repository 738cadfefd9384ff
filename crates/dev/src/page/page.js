// The page: sets up all sections, and shows connection, status and notices.

import { setUpCamera } from "/camera.js";
import { setUpCompare } from "/compare.js";
import { setUpFocus } from "/focus.js";
import { setUpInvalid } from "/invalid.js";
import { connect, element, isUpToDate, lastState, onFrame, onLink, onRefused, onState } from "/link.js";
import { setUpWheel } from "/numbers.js";
import { select, setUpObject } from "/object.js";
import { Picture } from "/picture.js";
import { setUpProbes } from "/probes.js";
import { errorBadge, showProblems } from "/problems.js";
import { setUpRender } from "/render.js";
import { setUpShader } from "/shader.js";
import { setUpTimes } from "/times.js";
import { setUpTouch } from "/touch.js";
import { setUpView, viewName } from "/view.js";

let isConnected = null; // null until the first connection attempt has ended
let isFull = false; // whether the viewer limit is reached
let lastNotice = null; // the number of the last notice; null until the first state of a connection
let shownFrame = 0; // the number of the displayed frame
// Keyboard actions: actions that are always available, and actions that need the focus on the image.
const [pageKeys, pictureKeys] = [new Map(), new Map()];

// Registers a key's action; `key` is a `KeyboardEvent.key`.
const onKey = (key, act) => pageKeys.set(key, act);
const onPictureKey = (key, act) => pictureKeys.set(key, act);

const picture = new Picture([...document.querySelectorAll("#panels figure")]);
setUpView(picture, onKey, showNotice);
setUpInvalid();
setUpCamera(picture, onPictureKey, showNotice);
setUpCompare(picture, onKey, showNotice);
setUpProbes(picture, onPictureKey);
setUpRender(onKey, showNotice);
setUpShader(showNotice);
setUpTimes();
setUpObject();
setUpTouch();
setUpWheel();
setUpFocus();
picture.clicked = select;

onLink((connected, full) => {
  [isConnected, isFull] = [connected, full];
  if (connected) [lastNotice, shownFrame] = [null, 0];
  showBadge();
});

onRefused((text) => showNotice(text, true));

onFrame((header, images) => {
  const isFirst = !picture.header;
  picture.show(header, images);
  if (isFirst && lastState()) showProblems(lastState(), true);
  showBadge();
  element("size").textContent = `${header.width} × ${header.height}`;
  const [width, height] = header.finest;
  element("smaller").parentElement.hidden = width === header.width && height === header.height;
  element("smaller").textContent = `${width} × ${height}`;
  shownFrame = header.number;
  // Attributes for scripts that control the page.
  const { revision, samples, done } = header;
  Object.assign(element("panels").dataset, { revision, samples, done, view: viewName(header.view), sent: header.sent.join("x") });
});

// For scripts that control the page: returns whether the image is final and includes the effects of all commands of this
// page. At least `minExecuted` commands of all viewers together must have been executed.
window.isSettled = (minExecuted) => {
  const state = lastState();
  return isUpToDate() && state.executed >= minExecuted && picture.isSettled() && !state.busy && state.frame > 0 && shownFrame >= state.frame;
};

onState((state) => {
  element("panels").dataset.executed = state.executed;
  document.title = `${state.problems.length ? "✗ " : ""}${state.scene} – wgray`;
  element("scene").textContent = state.scene;
  element("device").textContent = state.device;
  element("shaders").textContent = state.shaders ?? "built in";
  element("compile").textContent = state.compile_seconds === null ? "–" : duration(state.compile_seconds);
  picture.marks = state.marks;
  picture.describe(state);
  showBadge();
  showProblems(state, Boolean(picture.header));
  const { number = 0, text, bad } = state.notice ?? {};
  if (lastNotice !== null && number > lastNotice) showNotice(text, bad);
  lastNotice = number;
});

// Shows why the image is not up to date. Without a connection, disables the controls.
function showBadge() {
  const state = lastState();
  const [text, kind] = isConnected === null ? ["Connecting…", "waits"]
    : isFull ? ["Viewer limit reached. Waiting for a free slot…", "lost"]
    : !isConnected ? ["Connection lost. Reconnecting…", "lost"]
    : state?.compiling ? ["Compiling…", "waits"]
    : state?.reading ? ["Reading files…", "waits"]
    : !picture.header && state?.problems.length ? [errorBadge(state), "lost"]
    : !picture.header ? ["Waiting for the first image…", "waits"]
    : state?.no_comparison ? [state.no_comparison, "lost"]
    : state?.paused && state.samples ? ["Paused", "rests"]
    : ["", "live"];
  const badge = element("badge");
  if (badge.textContent !== text) badge.textContent = text;
  badge.className = kind;
  const isUsable = Boolean(isConnected && state && picture.header);
  for (const panel of [document.querySelector("aside"), element("toolbar")]) {
    panel.classList.toggle("off", !isUsable);
    for (const control of panel.querySelectorAll("fieldset, button, input, select")) setOff(control, !isUsable);
  }
}

// Disables a control, or enables it again, unless it is disabled for another reason.
function setOff(control, off) {
  if (off && !control.disabled) {
    control.disabled = true;
    control.dataset.off = "";
  } else if (!off && "off" in control.dataset) {
    control.disabled = false;
    delete control.dataset.off;
  }
}

let noticeTimer = 0;
// Shows a notice for a few seconds. An empty text hides an error notice.
function showNotice(text, bad) {
  const notice = element("notice");
  if (!text) {
    notice.hidden ||= notice.classList.contains("bad");
    return;
  }
  notice.textContent = text;
  notice.classList.toggle("bad", Boolean(bad));
  notice.hidden = false;
  clearTimeout(noticeTimer);
  noticeTimer = setTimeout(() => (notice.hidden = true), bad ? 8000 : 3000);
}

function duration(seconds) {
  return seconds < 1 ? `${Math.round(seconds * 1000)} ms` : `${seconds.toFixed(2)} s`;
}

// Returns true if a control handles a key. In the value editor, an accidental key press must not trigger an
// action that affects all viewers.
function handlesKey(control, key) {
  if (control.closest("#object-groups, #sliders")) return true;
  if (control.matches("select, textarea, input:not([type=radio], [type=checkbox], [type=range])")) return true;
  if (control.matches("input[type=range]")) return /^(Arrow|Page|Home$|End$)/.test(key);
  return key === " " && control.matches("button, summary, input, a, label");
}

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented || handlesKey(event.target, event.key)) return;
  const names = [event.key, event.shiftKey ? `Shift+${event.key.toLowerCase()}` : event.key.toLowerCase()];
  const maps = event.target.closest("#panels figure") ? [pictureKeys, pageKeys] : [pageKeys];
  const act = maps.flatMap((map) => names.map((name) => map.get(name))).find(Boolean);
  if (act && act(event) !== false) event.preventDefault();
});

connect();
