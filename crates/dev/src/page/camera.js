// The camera: drag tools, history, bookmarks, and saving to the scene file.

import { element, lastState, onState, sendCommand } from "/link.js";
import { enable, make } from "/parts.js";

const MAX_BOOKMARKS = 32; // maximum number of bookmarks per scene

export function setUpCamera(picture, onKey, showNotice) {
  const tools = { o: "orbit", p: "pan", d: "dolly", v: "fly", h: "hand" };
  picture.tool = () => document.querySelector("input[name=tool]:checked").value;
  const selectTool = (tool) => {
    document.querySelector(`input[name=tool][value=${tool}]`).checked = true;
    picture.stopFlying();
  };
  for (const [key, tool] of Object.entries(tools)) onKey(key, () => selectTool(tool));
  element("tools").addEventListener("change", () => picture.stopFlying());
  onKey("Escape", () => (picture.tool() === "fly" ? selectTool("orbit") : false));

  const bookmarks = setUpBookmarks(showNotice);
  const copy = () => copyCamera(showNotice);
  const actions = {
    copy, save: () => sendCommand("save_camera"), undo: () => sendCommand("undo_write"), reset: () => sendCommand("reset_camera"), back: () => sendCommand("back"),
    forth: () => sendCommand("forth"), "frame-all": () => sendCommand({ frame: null }), bookmark: bookmarks.add,
  };
  for (const [id, act] of Object.entries(actions)) element(id).addEventListener("click", act);
  onKey("c", copy);
  onKey("r", actions.reset);
  onKey("b", bookmarks.add);
  onKey("z", actions.back);
  onKey("Shift+z", actions.forth);
  onKey("Home", actions["frame-all"]);
  onKey("f", () => sendCommand({ frame: picture.cursor }));

  onState((state) => {
    element("camera-text").textContent = state.camera;
    element("moved").hidden = !state.camera_moved;
    showButtons(state);
    bookmarks.show(state.scene);
  });
}

function showButtons({ camera_moved, steps, undo, read_only }) {
  const enabled = { save: camera_moved && !read_only, reset: camera_moved, back: steps[0], forth: steps[1] };
  for (const [id, isEnabled] of Object.entries(enabled)) enable(element(id), isEnabled);
  element("undo").hidden = undo !== "camera";
  element("save").title = read_only ?? "Write this camera to the scene file";
  element("save").classList.toggle("main", !read_only);
  element("copy").classList.toggle("main", Boolean(read_only));
}

async function copyCamera(showNotice) {
  try {
    await navigator.clipboard.writeText(lastState().camera);
    showNotice("Camera copied");
  } catch {
    // The clipboard requires a secure connection. On other connections, the page selects the text for the user to copy.
    getSelection().selectAllChildren(element("camera-text"));
    showNotice("Press Ctrl+C to copy the selected camera");
  }
}

// Bookmarks are stored in the browser under the name of the scene, not in the scene file.
function setUpBookmarks(showNotice) {
  let scene = null;
  const key = () => `bookmarks ${scene}`;
  const stored = () => {
    try {
      return JSON.parse(localStorage.getItem(key())) ?? [];
    } catch {
      return []; // storage is disabled, or the stored text is not JSON
    }
  };
  const store = (bookmarks) => {
    try {
      localStorage.setItem(key(), JSON.stringify(bookmarks));
    } catch {
      showNotice("The browser refused to store the bookmark", true);
    }
    showAll();
  };
  const add = () => {
    const viewpoint = lastState()?.viewpoint;
    const bookmarks = stored();
    if (!viewpoint) return;
    if (bookmarks.length >= MAX_BOOKMARKS) return showNotice(`Bookmark limit reached (${MAX_BOOKMARKS}). Delete one first`, true);
    const numbers = bookmarks.map(({ name }) => Number(/^view (\d+)$/.exec(name)?.[1] ?? 0));
    store([...bookmarks, { name: `view ${Math.max(0, ...numbers) + 1}`, viewpoint }]);
  };
  const rename = (name, i) => {
    const newName = prompt("Bookmark name", name)?.trim();
    if (newName) store(stored().map((bookmark, j) => (j === i ? { ...bookmark, name: newName.slice(0, 60) } : bookmark)));
  };
  const button = (text, label, act) => {
    const control = make("button", { type: "button", textContent: text });
    if (label) control.setAttribute("aria-label", label);
    control.addEventListener("click", act);
    return control;
  };
  const showAll = () => element("bookmarks").replaceChildren(...stored().map(({ name, viewpoint }, i) => make("li", {},
    button(name, null, () => sendCommand({ viewpoint })),
    button("Rename", `Rename ${name}`, () => rename(name, i)),
    button("×", `Delete ${name}`, () => store(stored().filter((_, j) => j !== i))),
  )));
  const show = (name) => {
    if (name === scene) return;
    scene = name;
    showAll();
  };
  return { add, show };
}
