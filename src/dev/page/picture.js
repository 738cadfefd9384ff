// The picture: drawn zoomed and shifted, dragged, pointed at. Several panels show parts of one picture alike.

import { ask } from "/link.js";
import { viewName } from "/view.js";

// Zoom steps of one key or one notch of the wheel.
const STEP = 1.25;
const CLOSEST = 64;

const CLICK = 4; // CSS pixels that a hand may move in a click
const PAUSE = 400; // milliseconds between two gestures of the wheel
const PER_SECOND = 0.7; // how far one flies, in distances of what is looked at

export class Picture {
  constructor(figures) {
    this.panels = figures.map((figure) => new Panel(figure));
    this.pointed = () => {}; // is told when another pixel is pointed at
    this.clicked = () => {}; // is told a pixel that was clicked, without a drag
    this.zoomed = () => {};
    this.tool = () => "orbit";
    this.header = null;
    this.marks = true; // whether pixels that are no light get rings
    this.pins = []; // pixels that are marked
    this.gain = 1;
    this.layout = "side"; // of a comparison
    this.wiped = 0.5; // the share of the first picture in a wipe
    this.swapped = false; // whether a flicker shows the second picture
    this.held = new Set(); // keys of flying that are down
    this.speed = 1;
    this.wheeled = 0; // when the wheel was last turned
    // Screen pixels per picture pixel, or null to fit; the picture's point in the middle of a panel.
    this.scale = null;
    this.middle = [0, 0];
    this.cursor = null;
    this.pending = still();
    this.scheduled = false;
    for (const panel of this.panels) {
      this.#listen(panel);
      new ResizeObserver(() => this.#schedule()).observe(panel.canvas);
    }
    window.addEventListener("blur", () => this.stopFlying());
  }

  // Shows the parts of a frame: images by name.
  show(header, images) {
    const resized = !this.header || this.header.width !== header.width || this.header.height !== header.height;
    this.header = header;
    if (resized) this.fit();
    for (const panel of this.panels) panel.image = images.get(panel.part) ?? null;
    this.arrange(this.layout);
  }

  // Which of a comparison's pictures are shown: all beside each other, two in one place, or their difference.
  arrange(layout) {
    this.layout = layout;
    const alone = { wipe: "first", flicker: "first", difference: "difference" }[layout];
    const focused = this.panels.find((panel) => panel.canvas === document.activeElement);
    for (const panel of this.panels) {
      const compared = panel.part !== "picture";
      panel.figure.hidden = !panel.image || (compared && alone !== undefined && panel.part !== alone);
      if (compared) panel.caption(this.#caption(panel.part));
    }
    if (focused?.figure.hidden) this.#visible()?.canvas.focus({ preventScroll: true });
    const wipes = layout === "wipe" && Boolean(this.#part("second")?.image);
    document.getElementById("wipe").hidden = !wipes;
    this.#schedule();
  }

  #caption(part) {
    const [first, second] = this.header?.sides ?? ["", ""];
    if (part === "difference") return `Difference × ${this.gain}`;
    if (part === "second") return second;
    if (this.layout === "wipe") return `${first} | ${second}`;
    return this.layout === "flicker" && this.swapped ? second : first;
  }

  // What the difference is multiplied by.
  setGain(gain) {
    this.gain = gain;
    this.arrange(this.layout);
  }

  wipe(share) {
    this.wiped = share;
    this.#schedule();
  }

  // Shows the other picture of a flicker.
  swap() {
    this.swapped = !this.swapped;
    this.arrange(this.layout);
  }

  #part(part) {
    return this.panels.find((panel) => panel.part === part);
  }

  // Says what the canvases show, to who does not see it.
  describe(state) {
    const names = {
      color: "colour", compare: "comparison", uv: "texture coordinates", layer: `layer ${state.view.layer}`,
      direct: "direct light", indirect: "indirect light", emission: "emitted light",
    };
    const view = names[viewName(state.view)] ?? viewName(state.view).replace("_", " ");
    const parts = { picture: "", first: ", first picture", second: ", second picture", difference: ", difference" };
    for (const panel of this.panels) {
      panel.canvas.setAttribute("aria-label", `Viewport: ${view} of ${state.scene}${parts[panel.part]}`);
    }
  }

  fit() {
    this.scale = null;
    this.#schedule();
  }

  // By a factor, about a point of a panel if one is given.
  zoom(factor, panel = this.#visible(), at = null) {
    if (panel) this.zoomTo(this.#view(panel).scale * factor, panel, at);
  }

  zoomTo(scale, panel = this.#visible(), at = null) {
    if (!panel || !this.header) return;
    const old = this.#view(panel);
    at ??= [panel.canvas.clientWidth / 2, panel.canvas.clientHeight / 2];
    const fixed = [(at[0] - old.left) / old.scale, (at[1] - old.top) / old.scale];
    this.scale = Math.min(CLOSEST, Math.max(Math.min(1, old.fit) / 4, scale));
    const half = [panel.canvas.clientWidth / 2, panel.canvas.clientHeight / 2];
    this.middle = fixed.map((v, i) => v - (at[i] - half[i]) / this.scale);
    this.#schedule();
  }

  // Whether what the user did has been asked for and drawn.
  isSettled() {
    return !this.scheduled;
  }

  // Reads the pixel beside the last one read.
  moveCursor(dx, dy) {
    if (!this.header) return;
    const [x, y] = this.cursor ?? [this.header.width >> 1, this.header.height >> 1];
    const inside = (v, most) => Math.min(most - 1, Math.max(0, v));
    this.#point([inside(x + dx, this.header.width), inside(y + dy, this.header.height)]);
  }

  #visible() {
    return this.panels.find((panel) => !panel.figure.hidden);
  }

  // Where the picture lies in a panel, in CSS pixels.
  #view(panel) {
    const { clientWidth: w, clientHeight: h } = panel.canvas;
    const { width, height } = this.header ?? { width: 1, height: 1 };
    const fit = Math.max(1e-3, Math.min(w / width, h / height));
    const scale = this.scale ?? fit;
    const [x, y] = this.scale === null ? [width / 2, height / 2] : this.middle;
    const ratio = devicePixelRatio;
    const snap = (v) => Math.round(v * ratio) / ratio; // whole pixels stay whole
    return { scale, fit, left: snap(w / 2 - x * scale), top: snap(h / 2 - y * scale) };
  }

  #schedule() {
    if (this.scheduled) return;
    this.scheduled = true;
    requestAnimationFrame(() => {
      this.scheduled = false;
      this.#send();
      this.#draw();
    });
  }

  #draw() {
    if (!this.header) return;
    const { width, height, sent } = this.header;
    for (const panel of this.panels.filter((panel) => panel.image)) {
      const { canvas, image } = panel;
      const [w, h] = [canvas.clientWidth, canvas.clientHeight].map((v) => Math.round(v * devicePixelRatio));
      if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
      const view = this.#view(panel);
      const context = canvas.getContext("2d");
      context.setTransform(1, 0, 0, 1, 0, 0);
      context.clearRect(0, 0, w, h);
      const ratio = devicePixelRatio;
      context.setTransform(ratio, 0, 0, ratio, view.left * ratio, view.top * ratio);
      // Pixels are shown as squares where these are all alike or large; a coarse picture is smooth.
      const side = view.scale * ratio;
      context.imageSmoothingEnabled = sent[0] < width || (side < 4 && !Number.isInteger(side));
      context.imageSmoothingQuality = "high";
      const other = this.#part("second").image;
      const flickers = panel.part === "first" && this.layout === "flicker" && this.swapped && other;
      context.drawImage(flickers ? other : image, 0, 0, width * view.scale, height * view.scale);
      if (panel.part === "first" && this.layout === "wipe" && other) this.#drawWipe(context, canvas, view, other);
      if (this.marks && view.scale < 4) this.#ring(context, panel, view);
      if (this.cursor && view.scale >= 6) this.#frame(context, this.cursor, view.scale, 0);
      for (const pin of this.pins) this.#frame(context, pin, view.scale, Math.max(0, 5 - view.scale / 2));
      Object.assign(canvas.dataset, { left: view.left, top: view.top, scale: view.scale });
    }
    const shown = this.#visible();
    if (shown) this.zoomed(this.scale === null, this.#view(shown).scale);
  }

  // The second picture from the divider to the right.
  #drawWipe(context, canvas, view, other) {
    const { width, height } = this.header;
    const x = this.wiped * canvas.clientWidth - view.left;
    context.save();
    context.beginPath();
    context.rect(x, -view.top, canvas.clientWidth, canvas.clientHeight);
    context.clip();
    context.drawImage(other, 0, 0, width * view.scale, height * view.scale);
    context.restore();
    for (const [color, lineWidth] of [["#000", 3], ["#fff", 1]]) {
      Object.assign(context, { strokeStyle: color, lineWidth });
      context.beginPath();
      context.moveTo(x, -view.top);
      context.lineTo(x, canvas.clientHeight - view.top);
      context.stroke();
    }
  }

  // A frame around a pixel, so many CSS pixels away from it.
  #frame(context, pixel, scale, away) {
    context.lineWidth = 1;
    for (const [color, inset] of [["#000", -away], ["#fff", 1 - away]]) {
      context.strokeStyle = color;
      const [x, y] = pixel.map((v) => v * scale + inset);
      context.strokeRect(x, y, scale - 2 * inset, scale - 2 * inset);
    }
  }

  // Rings around pixels that are no light: one among a million is not overlooked.
  #ring(context, panel, view) {
    const { width, height, sent, faults } = this.header;
    const places = faults.find(([part]) => part === panel.part)?.[1].places ?? [];
    for (const [x, y] of places) {
      const [cx, cy] = [((x + 0.5) * width) / sent[0], ((y + 0.5) * height) / sent[1]];
      for (const [color, lineWidth] of [["#000", 4], ["#fff", 2]]) {
        Object.assign(context, { strokeStyle: color, lineWidth });
        context.beginPath();
        context.arc(cx * view.scale, cy * view.scale, 8, 0, 2 * Math.PI);
        context.stroke();
      }
    }
  }

  #listen(panel) {
    const { canvas } = panel;
    const fingers = new Map();
    let start = null; // where a hand came down, until it moves
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button === 2) return; // the browser's own menu
      if (event.button === 1) event.preventDefault(); // no scrolling by itself
      canvas.setPointerCapture(event.pointerId);
      canvas.classList.add("dragging");
      const place = [event.offsetX, event.offsetY];
      fingers.set(event.pointerId, place);
      start = fingers.size === 1 && event.button === 0 ? place : null;
      ask("grab");
      this.#point(this.#pixelAt(panel, place));
    });
    canvas.addEventListener("pointermove", (event) => {
      const now = [event.offsetX, event.offsetY];
      const last = fingers.get(event.pointerId);
      this.#point(this.#pixelAt(panel, now));
      if (!last) return;
      if (start && Math.hypot(now[0] - start[0], now[1] - start[1]) < CLICK) return;
      start = null;
      if (fingers.size === 2) this.#pinch(panel, fingers, event.pointerId, now);
      else this.#drag(panel, this.#toolOf(event), now[0] - last[0], now[1] - last[1]);
      fingers.set(event.pointerId, now);
    });
    const end = (event) => {
      fingers.delete(event.pointerId);
      if (fingers.size === 0) canvas.classList.remove("dragging");
    };
    canvas.addEventListener("pointerup", (event) => {
      const pixel = this.#pixelAt(panel, [event.offsetX, event.offsetY]);
      if (start && fingers.has(event.pointerId) && pixel) this.clicked(pixel);
      start = null;
      end(event);
    });
    canvas.addEventListener("pointercancel", end);
    canvas.addEventListener("pointerleave", (event) => {
      if (event.pointerType === "mouse") this.#point(null); // what a finger read stays
    });
    canvas.addEventListener("wheel", (event) => this.#wheel(panel, event), { passive: false });
    canvas.addEventListener("keydown", (event) => this.#key(event));
    canvas.addEventListener("keyup", (event) => this.held.delete(event.code));
    canvas.addEventListener("blur", () => this.stopFlying());
  }

  #toolOf(event) {
    if (event.buttons & 4 || event.shiftKey) return "pan";
    if (event.ctrlKey || event.metaKey) return "dolly";
    return this.tool();
  }

  #drag(panel, tool, dx, dy) {
    const view = this.#view(panel);
    // Across the panel is half a turn.
    const turn = Math.PI / Math.min(panel.canvas.clientWidth, panel.canvas.clientHeight);
    if (tool === "hand") {
      const [x, y] = this.scale === null ? [this.header.width / 2, this.header.height / 2] : this.middle;
      this.middle = [x - dx / view.scale, y - dy / view.scale];
      this.scale = view.scale;
    } else if (tool === "pan") {
      const height = this.header.height * view.scale;
      this.pending.pan[0] += dx / height;
      this.pending.pan[1] -= dy / height;
    } else if (tool === "dolly") {
      this.pending.dolly -= dy / 200;
    } else if (tool === "fly") {
      this.pending.look[0] += (dx * turn) / 2;
      this.pending.look[1] -= (dy * turn) / 2;
    } else {
      this.pending.orbit[0] += dx * turn;
      this.pending.orbit[1] += dy * turn;
    }
    this.#schedule();
  }

  // Two fingers: what is between them follows them.
  #pinch(panel, fingers, moving, now) {
    const [, other] = [...fingers].find(([id]) => id !== moving);
    const before = fingers.get(moving);
    const apart = (a, b) => Math.max(1, Math.hypot(a[0] - b[0], a[1] - b[1]));
    this.pending.dolly += Math.log(apart(now, other) / apart(before, other));
    this.#drag(panel, "pan", (now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
  }

  // The wheel dollies; with Ctrl, as a touch pad's pinch comes, it zooms the picture.
  #wheel(panel, event) {
    event.preventDefault();
    const place = [event.offsetX, event.offsetY];
    const lines = Math.max(-4, Math.min(4, event.deltaMode === 0 ? event.deltaY / 100 : event.deltaY / 3));
    if (event.ctrlKey || event.metaKey) {
      this.zoom(STEP ** -lines, panel, place);
    } else if (this.tool() === "fly") {
      this.speed = Math.min(100, Math.max(0.01, this.speed * STEP ** -lines));
    } else {
      if (event.timeStamp - this.wheeled > PAUSE) ask("grab");
      this.wheeled = event.timeStamp;
      this.pending.dolly -= lines * 0.1;
      this.#schedule();
    }
    this.#point(this.#pixelAt(panel, place));
  }

  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    const beside = { j: [-1, 0], l: [1, 0], i: [0, -1], k: [0, 1] }[event.key];
    const flies = this.tool() === "fly";
    const moves = arrow || event.key === "PageUp" || event.key === "PageDown";
    if (moves && !event.repeat) ask("grab");
    if (flies && FLIGHT[event.code]) {
      if (!this.held.size) ask("grab");
      this.held.add(event.code);
      this.#fly(event.shiftKey);
    } else if (arrow && event.shiftKey) {
      this.pending.pan[0] += arrow[0] * 0.05;
      this.pending.pan[1] -= arrow[1] * 0.05;
    } else if (arrow) {
      const turned = flies ? this.pending.look : this.pending.orbit;
      turned[0] += arrow[0] * 0.1;
      turned[1] += arrow[1] * (flies ? -0.1 : 0.1);
    } else if (event.key === "PageUp" || event.key === "PageDown") {
      this.pending.dolly += event.key === "PageUp" ? 0.1 : -0.1;
    } else if (beside) {
      this.moveCursor(...beside);
    } else {
      return;
    }
    event.preventDefault();
    event.stopPropagation();
    this.#schedule();
  }

  // Moves on as long as keys are down.
  #fly(fast) {
    this.fast = fast;
    if (this.flying) return;
    let last = performance.now();
    const step = (now) => {
      const way = ((now - last) / 1000) * PER_SECOND * this.speed * (this.fast ? 4 : 1);
      last = now;
      for (const code of this.held) FLIGHT[code].forEach((v, i) => (this.pending.fly[i] += v * way));
      this.flying = this.held.size > 0;
      if (this.flying) requestAnimationFrame(step);
      this.#send();
    };
    this.flying = true;
    requestAnimationFrame(step);
  }

  stopFlying() {
    this.held.clear();
  }

  // One message a frame of the screen, whatever the mouse's rate.
  #send() {
    const { orbit, pan, dolly, look, fly } = this.pending;
    if (orbit[0] || orbit[1]) ask({ move: { orbit } });
    if (pan[0] || pan[1]) ask({ move: { pan } });
    if (dolly) ask({ move: { dolly } });
    if (look[0] || look[1]) ask({ move: { look } });
    if (fly.some((v) => v)) ask({ move: { fly } });
    this.pending = still();
  }

  #pixelAt(panel, [x, y]) {
    if (!this.header) return null;
    const view = this.#view(panel);
    const pixel = [Math.floor((x - view.left) / view.scale), Math.floor((y - view.top) / view.scale)];
    const inside = pixel[0] >= 0 && pixel[1] >= 0 && pixel[0] < this.header.width && pixel[1] < this.header.height;
    return inside ? pixel : null;
  }

  #point(pixel) {
    if (String(pixel) === String(this.cursor)) return;
    this.cursor = pixel;
    this.pointed();
    this.#schedule();
  }
}

// The ways that keys fly: to the right, upwards, forwards.
const FLIGHT = {
  KeyW: [0, 0, 1], KeyS: [0, 0, -1], KeyA: [-1, 0, 0], KeyD: [1, 0, 0], KeyE: [0, 1, 0], KeyQ: [0, -1, 0],
};

// No move of the camera.
const still = () => ({ orbit: [0, 0], pan: [0, 0], dolly: 0, look: [0, 0], fly: [0, 0, 0] });

class Panel {
  constructor(figure) {
    this.figure = figure;
    this.part = figure.dataset.part;
    this.canvas = figure.querySelector("canvas");
    this.image = null;
  }

  caption(text) {
    const caption = this.figure.querySelector("figcaption");
    if (caption && caption.textContent !== text) caption.textContent = text;
  }
}
