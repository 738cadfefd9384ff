// The picture: drawn zoomed and shifted, dragged, pointed at. Several panels show parts of one picture alike.

// Zoom steps of one key or one notch of the wheel.
const STEP = 1.25;
const CLOSEST = 64;

export class Picture {
  // `ask` sends a command; `pointed` is told the pixel under the pointer, or null.
  constructor(figures, ask, pointed, zoomed) {
    this.panels = figures.map((figure) => new Panel(figure));
    this.ask = ask;
    this.pointed = pointed;
    this.zoomed = zoomed;
    this.tool = () => "orbit";
    this.header = null;
    this.marks = true; // whether pixels that are no light get rings
    // Screen pixels per picture pixel, or null to fit; the picture's point in the middle of a panel.
    this.scale = null;
    this.middle = [0, 0];
    this.cursor = null;
    this.pending = { orbit: [0, 0], pan: [0, 0], dolly: 0 };
    this.scheduled = false;
    for (const panel of this.panels) {
      this.#listen(panel);
      new ResizeObserver(() => this.#schedule()).observe(panel.canvas);
    }
  }

  // Shows the parts of a frame: images by name.
  show(header, images) {
    const resized = !this.header || this.header.width !== header.width || this.header.height !== header.height;
    this.header = header;
    if (resized) this.fit();
    for (const panel of this.panels) {
      panel.image = images.get(panel.part) ?? null;
      panel.figure.hidden = !panel.image;
    }
    this.#schedule();
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
      context.drawImage(image, 0, 0, width * view.scale, height * view.scale);
      if (this.marks && view.scale < 4) this.#ring(context, panel, view);
      if (this.cursor && view.scale >= 6) {
        context.lineWidth = 1;
        for (const [color, inset] of [["#000", 0], ["#fff", 1]]) {
          context.strokeStyle = color;
          const [x, y] = this.cursor.map((v) => v * view.scale + inset);
          context.strokeRect(x, y, view.scale - 2 * inset, view.scale - 2 * inset);
        }
      }
      Object.assign(canvas.dataset, { left: view.left, top: view.top, scale: view.scale });
    }
    const shown = this.#visible();
    if (shown) this.zoomed(this.scale === null, this.#view(shown).scale);
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
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      canvas.classList.add("dragging");
      fingers.set(event.pointerId, [event.offsetX, event.offsetY]);
    });
    canvas.addEventListener("pointermove", (event) => {
      const now = [event.offsetX, event.offsetY];
      const last = fingers.get(event.pointerId);
      if (last && fingers.size === 2) this.#pinch(panel, fingers, event.pointerId, now);
      else if (last) this.#drag(panel, this.#toolOf(event), now[0] - last[0], now[1] - last[1]);
      if (last) fingers.set(event.pointerId, now);
      this.#point(this.#pixelAt(panel, now));
    });
    const end = (event) => {
      fingers.delete(event.pointerId);
      if (fingers.size === 0) canvas.classList.remove("dragging");
    };
    canvas.addEventListener("pointerup", end);
    canvas.addEventListener("pointercancel", end);
    canvas.addEventListener("pointerleave", () => this.#point(null));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const lines = event.deltaMode === 0 ? event.deltaY / 100 : event.deltaY / 3;
      this.zoom(STEP ** -Math.max(-4, Math.min(4, lines)), panel, [event.offsetX, event.offsetY]);
      this.#point(this.#pixelAt(panel, [event.offsetX, event.offsetY]));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.#key(event));
  }

  #toolOf(event) {
    if (event.buttons & 4) return "hand";
    if (event.buttons & 2 || event.shiftKey) return "pan";
    if (event.ctrlKey || event.metaKey) return "dolly";
    return this.tool();
  }

  #drag(panel, tool, dx, dy) {
    const view = this.#view(panel);
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
    } else {
      // Across the panel is half a turn.
      const turn = Math.PI / Math.min(panel.canvas.clientWidth, panel.canvas.clientHeight);
      this.pending.orbit[0] += dx * turn;
      this.pending.orbit[1] += dy * turn;
    }
    this.#schedule();
  }

  #pinch(panel, fingers, moving, now) {
    const [, other] = [...fingers].find(([id]) => id !== moving);
    const before = fingers.get(moving);
    const apart = (a, b) => Math.max(1, Math.hypot(a[0] - b[0], a[1] - b[1]));
    this.zoom(apart(now, other) / apart(before, other), panel, other);
  }

  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    const beside = { j: [-1, 0], l: [1, 0], i: [0, -1], k: [0, 1] }[event.key];
    if (arrow && event.shiftKey) {
      this.pending.pan[0] += arrow[0] * 0.05;
      this.pending.pan[1] -= arrow[1] * 0.05;
    } else if (arrow) {
      this.pending.orbit[0] += arrow[0] * 0.1;
      this.pending.orbit[1] += arrow[1] * 0.1;
    } else if (event.key === "PageUp" || event.key === "PageDown") {
      this.pending.dolly += event.key === "PageUp" ? 0.1 : -0.1;
    } else if (beside) {
      this.moveCursor(...beside);
    } else {
      return;
    }
    event.preventDefault();
    this.#schedule();
  }

  // One message a frame of the screen, whatever the mouse's rate.
  #send() {
    const { orbit, pan, dolly } = this.pending;
    if (orbit[0] || orbit[1]) this.ask({ move: { orbit } });
    if (pan[0] || pan[1]) this.ask({ move: { pan } });
    if (dolly) this.ask({ move: { dolly } });
    this.pending = { orbit: [0, 0], pan: [0, 0], dolly: 0 };
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
    this.pointed(pixel);
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
}
