// The camera: what a drag does, the way back, bookmarks, and the scene file.

import { ask, element, lastState, onState } from "/link.js";

const MOST = 32; // bookmarks of a scene

export function setUpCamera(picture, onKey, showNotice) {
  const tools = { o: "orbit", p: "pan", d: "dolly", v: "fly", h: "hand" };
  picture.tool = () => document.querySelector("input[name=tool]:checked").value;
  const take = (tool) => {
    document.querySelector(`input[name=tool][value=${tool}]`).checked = true;
    picture.stopFlying();
  };
  for (const [key, tool] of Object.entries(tools)) onKey(key, () => take(tool));
  element("tools").addEventListener("change", () => picture.stopFlying());
  onKey("Escape", () => (picture.tool() === "fly" ? take("orbit") : false));

  const copy = () => copyCamera(showNotice);
  const actions = {
    copy, save: () => ask("save_camera"), undo: () => ask("undo_write"), reset: () => ask("reset_camera"), back: () => ask("back"),
    forth: () => ask("forth"), "frame-all": () => ask({ frame: null }), bookmark: add,
  };
  for (const [id, act] of Object.entries(actions)) element(id).addEventListener("click", act);
  onKey("c", copy);
  onKey("r", actions.reset);
  onKey("b", add);
  onKey("z", actions.back);
  onKey("Shift+z", actions.forth);
  onKey("Home", actions["frame-all"]);
  onKey("f", () => ask({ frame: picture.cursor }));

  let scene = null;
  onState((state) => {
    element("camera-text").textContent = state.camera;
    element("moved").hidden = !state.camera_moved;
    const enabled = { save: state.camera_moved, reset: state.camera_moved, back: state.steps[0], forth: state.steps[1] };
    for (const [id, on] of Object.entries(enabled)) {
      element(id).disabled = !on;
      delete element(id).dataset.off;
    }
    element("undo").hidden = state.undo !== "camera";
    if (state.scene !== scene) {
      scene = state.scene;
      showBookmarks();
    }
  });

  // They lie in the browser, by the scene's name: nothing of them is in the file.
  const place = () => `bookmarks ${scene}`;
  const stored = () => {
    try {
      return JSON.parse(localStorage.getItem(place())) ?? [];
    } catch {
      return []; // there is no storage, or something else lies there
    }
  };
  function store(bookmarks) {
    try {
      localStorage.setItem(place(), JSON.stringify(bookmarks));
    } catch {
      showNotice("the browser keeps no bookmarks here", true);
    }
    showBookmarks();
  }

  function add() {
    const viewpoint = lastState()?.viewpoint;
    const bookmarks = stored();
    if (!viewpoint) return;
    if (bookmarks.length >= MOST) return showNotice(`${MOST} bookmarks are there already`, true);
    const numbers = bookmarks.map(({ name }) => Number(/^view (\d+)$/.exec(name)?.[1] ?? 0));
    store([...bookmarks, { name: `view ${Math.max(0, ...numbers) + 1}`, viewpoint }]);
  }

  function showBookmarks() {
    const items = stored().map(({ name, viewpoint }, i) => {
      const item = document.createElement("li");
      const button = (text, label, act) => {
        const button = Object.assign(document.createElement("button"), { type: "button", textContent: text });
        if (label) button.setAttribute("aria-label", label);
        button.addEventListener("click", act);
        return button;
      };
      const rename = () => {
        const given = prompt("Name of the bookmark", name)?.trim();
        if (given) store(stored().map((bookmark, j) => (j === i ? { ...bookmark, name: given.slice(0, 60) } : bookmark)));
      };
      item.append(
        button(name, null, () => ask({ viewpoint })),
        button("Rename", `Rename ${name}`, rename),
        button("×", `Delete ${name}`, () => store(stored().filter((_, j) => j !== i))),
      );
      return item;
    });
    element("bookmarks").replaceChildren(...items);
  }
}

async function copyCamera(showNotice) {
  try {
    await navigator.clipboard.writeText(lastState().camera);
    showNotice("camera copied");
  } catch {
    // Without a secure connection there is no clipboard: the text is selected for the user to copy.
    getSelection().selectAllChildren(element("camera-text"));
    showNotice("selected: press Ctrl+C to copy");
  }
}
