// The image: zooming, panning, pointing and camera drags. The panels of a comparison share one zoom.

import { sendCommand } from "/link.js";
import { isFlightKey, Motion } from "/motion.js";
import { divider, frame, rings } from "/overlay.js";
import { viewName } from "/view.js";

const ZOOM_FACTOR = 1.25; // zoom factor per notch of the wheel
const MAX_SCALE = 64;
const MAX_CLICK_DISTANCE = 4; // maximum pointer movement of a click, in CSS pixels
const GESTURE_PAUSE = 400; // minimum pause between two wheel gestures, in milliseconds
const GRIP_DISTANCE = { mouse: 7, touch: 22 }; // maximum distance in CSS pixels at which a press grabs the divider

export class Picture {
  constructor(figures) {
    this.panels = figures.map((figure) => new Panel(figure));
    this.pointed = () => {}; // called when the pointer moves to another pixel
    this.clicked = () => {}; // called with the clicked pixel
    this.zoomed = () => {}; // called with (whether the image fits the panel, the scale)
    this.wiping = () => {}; // called with the divider's position while the divider is dragged
    this.tool = () => "orbit";
    this.header = null;
    this.marks = true; // whether invalid pixels get rings
    this.pins = []; // pinned pixels, which are marked
    this.gain = 1;
    this.layout = "side"; // layout of a comparison
    this.dividerPosition = 0.5; // position of a wipe's divider, 0 to 1
    this.swapped = false; // whether a flicker shows the second image
    this.motion = new Motion();
    this.lastWheelTime = 0; // time of the last wheel event
    this.scale = null; // CSS pixels per image pixel; null fits the image to the panel
    this.middle = [0, 0]; // the image point at the center of a panel
    this.cursor = null; // the last read pixel
    this.scheduled = false;
    for (const panel of this.panels) {
      this.#listen(panel);
      new ResizeObserver(() => this.#schedule()).observe(panel.canvas);
    }
    window.addEventListener("blur", () => this.stopFlying());
  }

  // Shows the images of a frame; `images` maps names to images.
  show(header, images) {
    const resized = !this.header || this.header.width !== header.width || this.header.height !== header.height;
    this.header = header;
    if (resized) this.fit();
    for (const panel of this.panels) panel.image = images.get(panel.part) ?? null;
    this.arrange(this.layout);
  }

  // Selects the layout of a comparison: "side", "wipe", "flicker" or "difference".
  arrange(layout) {
    this.layout = layout;
    const visiblePart = { wipe: "first", flicker: "first", difference: "difference" }[layout]; // undefined: all parts
    const focused = this.panels.find((panel) => panel.canvas === document.activeElement);
    for (const panel of this.panels) {
      const isCompared = panel.part !== "picture";
      panel.figure.hidden = !panel.image || (isCompared && visiblePart !== undefined && panel.part !== visiblePart);
      if (isCompared) panel.caption(this.#caption(panel.part));
    }
    if (focused?.figure.hidden) this.#visible()?.canvas.focus({ preventScroll: true });
    document.getElementById("wipe").hidden = !this.#isWiping();
    this.#schedule();
  }

  #isWiping() {
    return this.layout === "wipe" && Boolean(this.#part("second")?.image);
  }

  #caption(part) {
    const [first, second] = this.header?.sides ?? ["", ""];
    if (part === "difference") return `Difference × ${this.gain}`;
    if (part === "second") return second;
    if (this.layout === "wipe") return `${first} | ${second}`;
    return this.layout === "flicker" && this.swapped ? second : first;
  }

  // Sets the gain of the difference.
  setGain(gain) {
    this.gain = gain;
    this.arrange(this.layout);
  }

  // Moves the divider of a wipe.
  wipe(position) {
    this.dividerPosition = Math.min(1, Math.max(0, position));
    this.#schedule();
  }

  // Swaps the two images of a flicker.
  swap() {
    this.swapped = !this.swapped;
    this.arrange(this.layout);
  }

  #part(part) {
    return this.panels.find((panel) => panel.part === part);
  }

  // Names the canvases for screen readers.
  describe(state) {
    const names = {
      color: "colour", compare: "comparison", uv: "texture coordinates",
      direct: "direct light", indirect: "indirect light", emission: "emitted light",
    };
    const view = names[viewName(state.view)] ?? viewName(state.view).replace("_", " ");
    const parts = { picture: "", first: ", first image", second: ", second image", difference: ", difference" };
    for (const panel of this.panels) {
      panel.canvas.setAttribute("aria-label", `Viewport: ${view} of ${state.scene}${parts[panel.part]}`);
    }
  }

  fit() {
    this.scale = null;
    this.#schedule();
  }

  // Zooms by a factor around a point of a panel, by default around its center.
  zoom(factor, panel = this.#visible(), point = null) {
    if (panel) this.zoomTo(this.#view(panel).scale * factor, panel, point);
  }

  zoomTo(scale, panel = this.#visible(), point = null) {
    if (!panel || !this.header) return;
    const old = this.#view(panel);
    point ??= [panel.canvas.clientWidth / 2, panel.canvas.clientHeight / 2];
    const anchor = [(point[0] - old.left) / old.scale, (point[1] - old.top) / old.scale];
    this.scale = Math.min(MAX_SCALE, Math.max(Math.min(1, old.fit) / 4, scale));
    const half = [panel.canvas.clientWidth / 2, panel.canvas.clientHeight / 2];
    this.middle = anchor.map((v, i) => v - (point[i] - half[i]) / this.scale);
    this.#schedule();
  }

  // Returns true if all input has been sent and drawn.
  isSettled() {
    return !this.scheduled;
  }

  // Moves the cursor from the last read pixel to a neighbour, and reads the neighbour.
  moveCursor(dx, dy) {
    if (!this.header) return;
    const [x, y] = this.cursor ?? [this.header.width >> 1, this.header.height >> 1];
    const clamp = (v, size) => Math.min(size - 1, Math.max(0, v));
    this.#point([clamp(x + dx, this.header.width), clamp(y + dy, this.header.height)]);
  }

  #visible() {
    return this.panels.find((panel) => !panel.figure.hidden);
  }

  // Returns the position and scale of the image in a panel, in CSS pixels.
  #view(panel) {
    const { clientWidth: w, clientHeight: h } = panel.canvas;
    const { width, height } = this.header ?? { width: 1, height: 1 };
    const fit = Math.max(1e-3, Math.min(w / width, h / height));
    const scale = this.scale ?? fit;
    const [x, y] = this.scale === null ? [width / 2, height / 2] : this.middle;
    const ratio = devicePixelRatio;
    const snap = (v) => Math.round(v * ratio) / ratio; // keeps integer scales sharp
    return { scale, fit, left: snap(w / 2 - x * scale), top: snap(h / 2 - y * scale) };
  }

  #schedule() {
    if (this.scheduled) return;
    this.scheduled = true;
    requestAnimationFrame(() => {
      this.scheduled = false;
      this.motion.send();
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
      // Pixels are drawn as squares if they are large or a whole number of screen pixels wide. Coarse images are
      // smoothed.
      const side = view.scale * ratio;
      context.imageSmoothingEnabled = sent[0] < width || (side < 4 && !Number.isInteger(side));
      context.imageSmoothingQuality = "high";
      const second = this.#part("second").image;
      const showsSecond = panel.part === "first" && this.layout === "flicker" && this.swapped && second;
      context.drawImage(showsSecond ? second : image, 0, 0, width * view.scale, height * view.scale);
      if (panel.part === "first" && this.#isWiping()) this.#drawWipe(context, canvas, view, second);
      if (this.marks && view.scale < 4) rings(context, panel.part, this.header, view.scale);
      if (this.cursor && view.scale >= 6) frame(context, this.cursor, view.scale, 0);
      for (const pin of this.pins) frame(context, pin, view.scale, Math.max(0, 5 - view.scale / 2));
      Object.assign(canvas.dataset, { left: view.left, top: view.top, scale: view.scale });
    }
    const visible = this.#visible();
    if (visible) this.zoomed(this.scale === null, this.#view(visible).scale);
  }

  // Draws the second image to the right of the divider.
  #drawWipe(context, canvas, view, second) {
    const { width, height } = this.header;
    const x = this.dividerPosition * canvas.clientWidth - view.left;
    context.save();
    context.beginPath();
    context.rect(x, -view.top, canvas.clientWidth, canvas.clientHeight);
    context.clip();
    context.drawImage(second, 0, 0, width * view.scale, height * view.scale);
    context.restore();
    divider(context, x, -view.top, canvas.clientHeight - view.top);
  }

  // Returns true if a pointer is at the divider of a wipe.
  #isAtDivider(panel, event) {
    const grip = GRIP_DISTANCE[event.pointerType] ?? GRIP_DISTANCE.mouse;
    return panel.part === "first" && this.#isWiping() && Math.abs(event.offsetX - this.dividerPosition * panel.canvas.clientWidth) <= grip;
  }

  #listen(panel) {
    const { canvas } = panel;
    const fingers = new Map();
    let start = null; // position of a press until the pointer moves
    let isWiping = false; // whether the divider is dragged
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button === 2) return; // the browser's context menu
      if (event.button === 1) event.preventDefault(); // no autoscroll
      canvas.setPointerCapture(event.pointerId);
      canvas.classList.add("dragging");
      const position = [event.offsetX, event.offsetY];
      fingers.set(event.pointerId, position);
      isWiping = fingers.size === 1 && event.button === 0 && this.#isAtDivider(panel, event);
      start = fingers.size === 1 && event.button === 0 && !isWiping ? position : null;
      if (!isWiping) sendCommand("grab");
      this.#point(this.#pixelAt(panel, position));
    });
    canvas.addEventListener("pointermove", (event) => {
      const position = [event.offsetX, event.offsetY];
      const last = fingers.get(event.pointerId);
      this.#point(this.#pixelAt(panel, position));
      canvas.classList.toggle("wiping", isWiping || this.#isAtDivider(panel, event));
      if (!last) return;
      if (start && Math.hypot(position[0] - start[0], position[1] - start[1]) < MAX_CLICK_DISTANCE) return;
      start = null;
      if (isWiping) this.#dragDivider(panel, position[0]);
      else if (fingers.size === 2) this.#pinch(panel, fingers, event.pointerId, position);
      else this.#drag(panel, this.#toolOf(event), position[0] - last[0], position[1] - last[1]);
      fingers.set(event.pointerId, position);
    });
    const end = (event) => {
      fingers.delete(event.pointerId);
      if (fingers.size > 0) return;
      isWiping = false;
      canvas.classList.remove("dragging");
    };
    canvas.addEventListener("pointerup", (event) => {
      const pixel = this.#pixelAt(panel, [event.offsetX, event.offsetY]);
      if (start && fingers.has(event.pointerId) && pixel) this.clicked(pixel);
      start = null;
      end(event);
    });
    canvas.addEventListener("pointercancel", end);
    canvas.addEventListener("pointerleave", (event) => {
      if (event.pointerType === "mouse") this.#point(null); // a value that was read by touch stays visible
    });
    canvas.addEventListener("wheel", (event) => this.#wheel(panel, event), { passive: false });
    canvas.addEventListener("keydown", (event) => this.#key(event));
    canvas.addEventListener("keyup", (event) => this.motion.release(event.code));
    canvas.addEventListener("blur", () => this.stopFlying());
  }

  #toolOf(event) {
    if (event.buttons & 4 || event.shiftKey) return "pan";
    if (event.ctrlKey || event.metaKey) return "dolly";
    return this.tool();
  }

  #dragDivider(panel, x) {
    this.wipe(x / panel.canvas.clientWidth);
    this.wiping(this.dividerPosition);
  }

  #drag(panel, tool, dx, dy) {
    const view = this.#view(panel);
    const { pending } = this.motion;
    // A drag as long as the shorter side of the panel orbits by half a turn.
    const angle = Math.PI / Math.min(panel.canvas.clientWidth, panel.canvas.clientHeight); // per CSS pixel
    if (tool === "hand") {
      const [x, y] = this.scale === null ? [this.header.width / 2, this.header.height / 2] : this.middle;
      this.middle = [x - dx / view.scale, y - dy / view.scale];
      this.scale = view.scale;
    } else if (tool === "pan") {
      const height = this.header.height * view.scale;
      pending.pan[0] += dx / height;
      pending.pan[1] -= dy / height;
    } else if (tool === "dolly") {
      pending.dolly -= dy / 200;
    } else if (tool === "fly") {
      pending.look[0] += (dx * angle) / 2;
      pending.look[1] -= (dy * angle) / 2;
    } else {
      pending.orbit[0] += dx * angle;
      pending.orbit[1] += dy * angle;
    }
    this.#schedule();
  }

  // Two fingers pan and dolly, so that the image follows the fingers.
  #pinch(panel, fingers, movedFinger, position) {
    const [, otherPosition] = [...fingers].find(([id]) => id !== movedFinger);
    const last = fingers.get(movedFinger);
    const distance = (a, b) => Math.max(1, Math.hypot(a[0] - b[0], a[1] - b[1]));
    this.motion.pending.dolly += Math.log(distance(position, otherPosition) / distance(last, otherPosition));
    this.#drag(panel, "pan", (position[0] - last[0]) / 2, (position[1] - last[1]) / 2);
  }

  // The wheel dollies the camera. With Ctrl, the wheel zooms the image. Browsers report a pinch on a touchpad as a
  // wheel event with Ctrl.
  #wheel(panel, event) {
    event.preventDefault();
    const position = [event.offsetX, event.offsetY];
    const lines = Math.max(-4, Math.min(4, event.deltaMode === 0 ? event.deltaY / 100 : event.deltaY / 3));
    if (event.ctrlKey || event.metaKey) {
      this.zoom(ZOOM_FACTOR ** -lines, panel, position);
    } else if (this.tool() === "fly") {
      this.motion.speed = Math.min(100, Math.max(0.01, this.motion.speed * ZOOM_FACTOR ** -lines));
    } else {
      if (event.timeStamp - this.lastWheelTime > GESTURE_PAUSE) sendCommand("grab");
      this.lastWheelTime = event.timeStamp;
      this.motion.pending.dolly -= lines * 0.1;
      this.#schedule();
    }
    this.#point(this.#pixelAt(panel, position));
  }

  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    const neighbour = { j: [-1, 0], l: [1, 0], i: [0, -1], k: [0, 1] }[event.key];
    const isFlying = this.tool() === "fly";
    const { motion } = this;
    const isMove = arrow || event.key === "PageUp" || event.key === "PageDown";
    if (isMove && !event.repeat) sendCommand("grab");
    if (isFlying && isFlightKey(event.code)) {
      motion.press(event.code, event.shiftKey);
    } else if (arrow && event.shiftKey) {
      motion.pending.pan[0] += arrow[0] * 0.05;
      motion.pending.pan[1] -= arrow[1] * 0.05;
    } else if (arrow) {
      const angles = isFlying ? motion.pending.look : motion.pending.orbit;
      angles[0] += arrow[0] * 0.1;
      angles[1] += arrow[1] * (isFlying ? -0.1 : 0.1);
    } else if (event.key === "PageUp" || event.key === "PageDown") {
      motion.pending.dolly += event.key === "PageUp" ? 0.1 : -0.1;
    } else if (neighbour) {
      this.moveCursor(...neighbour);
    } else {
      return;
    }
    event.preventDefault();
    event.stopPropagation();
    this.#schedule();
  }

  stopFlying() {
    this.motion.stop();
  }

  #pixelAt(panel, [x, y]) {
    if (!this.header) return null;
    const view = this.#view(panel);
    const pixel = [Math.floor((x - view.left) / view.scale), Math.floor((y - view.top) / view.scale)];
    const isInside = pixel[0] >= 0 && pixel[1] >= 0 && pixel[0] < this.header.width && pixel[1] < this.header.height;
    return isInside ? pixel : null;
  }

  #point(pixel) {
    if (String(pixel) === String(this.cursor)) return;
    this.cursor = pixel;
    this.pointed();
    this.#schedule();
  }
}

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
