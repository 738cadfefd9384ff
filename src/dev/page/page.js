// The page: the picture and around it what is known and wrong; the sections have modules of their own.

import { setUpCamera } from "/camera.js";
import { setUpCompare } from "/compare.js";
import { editorLink } from "/editor.js";
import { setUpFocus } from "/focus.js";
import { connect, element, isHeard, lastState, onFrame, onLink, onRefused, onState } from "/link.js";
import { select, setUpObject } from "/object.js";
import { Picture } from "/picture.js";
import { setUpProbes } from "/probes.js";
import { setUpRender } from "/render.js";
import { setUpShader } from "/shader.js";
import { setUpTimes } from "/times.js";
import { setUpTouch } from "/touch.js";
import { setUpView, viewName } from "/view.js";

let isLinked = null; // not known yet
let isFull = false; // whether nobody more may look
let noticesSeen = null;
let numberShown = 0; // the number of the frame on the screen
// What a key does everywhere, and what it does while the picture has the focus.
const [everywhere, atPicture] = [new Map(), new Map()];

// Names a key's action: `key` as KeyboardEvent has it.
const onKey = (key, act) => everywhere.set(key, act);
const onPictureKey = (key, act) => atPicture.set(key, act);

const picture = new Picture([...document.querySelectorAll("#panels figure")]);
setUpView(picture, onKey);
setUpCamera(picture, onPictureKey, showNotice);
setUpCompare(picture, onKey, showNotice);
setUpProbes(picture, onPictureKey);
setUpRender(onKey, showNotice);
setUpShader();
setUpTimes();
setUpObject();
setUpTouch();
setUpFocus();
picture.clicked = select;

onLink((there, full) => {
  [isLinked, isFull] = [there, full];
  if (there) [noticesSeen, numberShown] = [null, 0];
  showBadge();
});

onRefused((text) => showNotice(text, true));

onFrame((header, images) => {
  const first = !picture.header;
  picture.show(header, images);
  if (first) showProblems(lastState());
  showBadge();
  element("size").textContent = `${header.width} × ${header.height}`;
  const [width, height] = header.finest;
  element("smaller").parentElement.hidden = width === header.width && height === header.height;
  element("smaller").textContent = `${width} × ${height}`;
  numberShown = header.number;
  // For whoever wants to know by script what is on the screen.
  const { revision, samples, done } = header;
  Object.assign(element("panels").dataset, { revision, samples, done, view: viewName(header.view), sent: header.sent.join("x") });
});

// Whether all that was asked for here, and so many commands of anybody, is on the screen, and nothing more will come of
// it. For whoever drives the page by script.
window.isSettled = (commands) => {
  const state = lastState();
  return isHeard() && state.heard >= commands && picture.isSettled() && !state.busy && state.frame > 0 && numberShown >= state.frame;
};

onState((state) => {
  element("panels").dataset.heard = state.heard;
  document.title = `${state.problems.length ? "✗ " : ""}${state.scene} – wgray`;
  element("scene").textContent = state.scene;
  element("device").textContent = state.device;
  element("shaders").textContent = state.shaders ?? "those in the program";
  element("compile").textContent = state.compile_seconds === null ? "–" : seconds(state.compile_seconds);
  picture.marks = state.marks;
  picture.describe(state);
  showBadge();
  showProblems(state);
  const { number = 0, text, bad } = state.notice ?? {};
  if (noticesSeen !== null && number > noticesSeen) showNotice(text, bad);
  noticesSeen = number;
});

// What keeps the picture from being the newest, on the picture itself. Without a connection nothing can be done.
function showBadge() {
  const state = lastState();
  const says = isLinked === null ? ["connecting", "waits"]
    : isFull ? ["as many look as may at once; waiting for a place", "lost"]
    : !isLinked ? ["connection lost, trying again", "lost"]
    : state?.compiling ? ["compiling", "waits"]
    : !picture.header ? ["waiting for the first picture", "waits"]
    : state?.no_comparison ? [state.no_comparison, "lost"]
    : state?.paused && state.samples ? ["paused", "rests"]
    : ["", "live"];
  const badge = element("badge");
  if (badge.textContent !== says[0]) badge.textContent = says[0];
  badge.className = says[1];
  const works = Boolean(isLinked && state && picture.header);
  for (const part of [document.querySelector("aside"), element("toolbar"), element("zooming")]) {
    part.classList.toggle("off", !works);
    for (const fieldset of part.querySelectorAll("fieldset, button, input, select")) setOff(fieldset, !works);
  }
}

// Disables what is not disabled for a reason of its own, and gives it back.
function setOff(control, off) {
  if (off && !control.disabled) {
    control.disabled = true;
    control.dataset.off = "";
  } else if (!off && "off" in control.dataset) {
    control.disabled = false;
    delete control.dataset.off;
  }
}

let problemsShown = "";
function showProblems(state) {
  if (!state) return;
  const { problems, editor } = state;
  // What is read or selected stays as it is.
  const all = JSON.stringify([problems, editor, Boolean(picture.header)]);
  if (all === problemsShown) return;
  problemsShown = all;
  const make = (tag, text) => Object.assign(document.createElement(tag), { textContent: text });
  const articles = problems.map((problem) => {
    const article = document.createElement("article");
    const title = make("h2", problem.place ?? problem.kind);
    const link = editorLink(editor, problem);
    if (link) title.replaceChildren(Object.assign(make("a", problem.place ?? problem.kind), { href: link, title: "Open in the editor" }));
    article.append(title, make("p", problem.message));
    if (problem.excerpt) article.append(make("pre", problem.excerpt));
    const stays = picture.header ? "; the picture is the last good one" : "";
    article.append(make("small", `${problem.kind} error${stays}`));
    return article;
  });
  const dock = element("problems");
  dock.hidden = !problems.length;
  dock.querySelector("summary").textContent = problems.length === 1 ? "1 problem" : `${problems.length} problems`;
  element("problem-list").replaceChildren(...articles);
}

let noticeTimer = 0;
// Without a text what was wrong is no longer told.
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

function seconds(s) {
  return s < 1 ? `${Math.round(s * 1000)} ms` : `${s.toFixed(2)} s`;
}

// Whether a control has a use of its own for a key. Where values are typed a key that goes astray must not act on all viewers.
function isTaken(control, key) {
  if (control.closest("#object-groups, #sliders")) return true;
  if (control.matches("select, textarea, input:not([type=radio], [type=checkbox], [type=range])")) return true;
  if (control.matches("input[type=range]")) return /^(Arrow|Page|Home$|End$)/.test(key);
  return key === " " && control.matches("button, summary, input, a, label");
}

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented || isTaken(event.target, event.key)) return;
  const names = [event.key, event.shiftKey ? `Shift+${event.key.toLowerCase()}` : event.key.toLowerCase()];
  const maps = event.target.closest("#panels figure") ? [atPicture, everywhere] : [everywhere];
  const act = maps.flatMap((map) => names.map((name) => map.get(name))).find(Boolean);
  if (act && act(event) !== false) event.preventDefault();
});

connect();
