// Functions for the tests of the page: a scene in a temporary folder, the program and the browser.

import assert from "node:assert/strict";
import { spawn, execFileSync } from "node:child_process";
import fs from "node:fs";
import { createRequire } from "node:module";
import os from "node:os";
import path from "node:path";
import { fileURLToPath } from "node:url";

const ROOT = path.resolve(path.dirname(fileURLToPath(import.meta.url)), "../..");
export const PROGRAM = process.env.WGRAY_PROGRAM;
const { chromium } = createRequire(path.join(process.env.WGRAY_PAGE_MODULES, "/"))("playwright-core");

// Timeout of each wait in milliseconds, long enough for a busy machine.
export const TIMEOUT = 40_000;

export const SCENE = `# a small scene
[image]
width = 120
height = 90

[camera] # from the front
position = [0, -4, 1] # a comment
look_at = [0, 0, 0.5]
fov = 40

[render]
ambient = [0.2, 0.2, 0.2]
pixel_samples = { pattern = "grid", count = 4 }
light_samples = { pattern = "grid", count = 4 }

[materials.red]
type = "phong"
color = [0.8, 0.1, 0.1]
shininess = 16

[materials.grey]
type = "phong"
color = [0.6, 0.6, 0.6]
shininess = 16

[[lights]]
type = "rectangle"
center = [0, 0, 3]
size = [1, 1]
normal = [0, 0, -1]
tangent = [1, 0, 0]
color = [0.8, 0.8, 0.8]

[[shapes]]
type = "sphere"
material = "red"
center = [0, 0, 0.5]
radius = 0.5

[[shapes]]
type = "plane"
material = "grey"
point = [0, 0, 0]
normal = [0, 0, 1]
tangent = [1, 0, 0]
`;

const KERNEL = "shaders/kernels/render.wgsl";
const RADIANCE = "path_value(path)";

// A folder with a scene and shaders, and the program that watches the folder.
export class Studio {
  constructor() {
    this.folder = fs.mkdtempSync(path.join(os.tmpdir(), "wgray-page-"));
    fs.cpSync(path.join(ROOT, "shaders"), this.path("shaders"), { recursive: true });
    this.write("scene.toml", SCENE);
  }

  path(name) {
    return path.join(this.folder, name);
  }

  read(name) {
    return fs.readFileSync(this.path(name), "utf8");
  }

  write(name, text) {
    fs.writeFileSync(this.path(name), text);
  }

  edit(name, old, replacement) {
    const text = this.read(name);
    assert.ok(text.includes(old), `${name} has no '${old}'`);
    this.write(name, text.replace(old, replacement));
  }

  // Saves a kernel that sets the green and the blue channel to 0.
  redden() {
    this.edit(KERNEL, RADIANCE, `(${RADIANCE} * vec4f(1.0, 0.0, 0.0, 1.0))`);
  }

  breakShader() {
    this.edit(KERNEL, RADIANCE, "path_value(simple)");
  }

  fixShader() {
    this.edit(KERNEL, "simple", "path");
  }

  // Returns the line number of the shader error, counted from 1.
  errorLine() {
    return this.read(KERNEL).split("\n").findIndex((line) => line.includes("simple")) + 1;
  }

  // Returns the bytes of the PNG file that `wgray render` writes.
  render() {
    const out = this.path("rendered.png");
    this.renderTo(out);
    return [...fs.readFileSync(out)];
  }

  renderTo(file, extraArgs = []) {
    execFileSync(PROGRAM, ["render", this.path("scene.toml"), "--output", file, "--quiet", ...extraArgs], { stdio: "pipe" });
  }

  // Throws unless two image files are equal, bit for bit.
  diff(a, b) {
    execFileSync(PROGRAM, ["diff", a, b], { stdio: "pipe" });
  }

  // Starts the program. Resolves when the program has printed its address.
  async start(port = 0, extraArgs = [], scene = "scene.toml") {
    const args = ["dev", scene, "--shaders", "shaders", "--listen", `127.0.0.1:${port}`, ...extraArgs];
    this.program = spawn(PROGRAM, args, { cwd: this.folder, stdio: ["ignore", "inherit", "pipe"] });
    this.stderr = "";
    const address = new Promise((resolve, reject) => {
      this.program.stderr.on("data", (data) => {
        this.stderr += data;
        const url = /http:\/\/[\d.:]+\//.exec(this.stderr);
        if (url) resolve(url[0]);
      });
      this.program.on("exit", () => reject(new Error(`the program exited: ${this.stderr}`)));
    });
    this.url = await address;
    this.port = Number(new URL(this.url).port);
  }

  async stop() {
    if (this.program?.exitCode === null && this.program.signalCode === null) {
      const exited = new Promise((resolve) => this.program.on("exit", resolve));
      this.program.kill("SIGKILL");
      await exited;
    }
  }

  async remove() {
    await this.stop();
    fs.rmSync(this.folder, { recursive: true, force: true });
  }
}

export function launch(extraArgs = []) {
  return chromium.launch({
    executablePath: process.env.WGRAY_CHROMIUM,
    args: [
      "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
      "--disable-component-update", "--disable-sync", ...(process.env.WGRAY_PAGE ? ["--disable-features=LocalNetworkAccessChecks"] : []), ...extraArgs,
    ],
  });
}

// Opens the page and waits for a finished image. `page.errors` collects the errors of the page.
export async function open(browser, studio, options = {}) {
  const page = await visit(browser, studio, options);
  await waitForImage(page);
  return page;
}

// Opens the page without waiting for an image.
export async function visit(browser, studio, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1200, height: 800 }, ...options });
  const page = await context.newPage();
  page.setDefaultTimeout(TIMEOUT);
  page.errors = [];
  page.on("console", (message) => {
    if (message.type() === "error") page.errors.push(message.text());
  });
  page.on("pageerror", (error) => page.errors.push(error.message));
  page.on("request", (request) => {
    if (!/^(data|blob):/.test(request.url()) && new URL(request.url()).port !== String(studio.port)) {
      page.errors.push(`the page requested ${request.url()}`);
    }
  });
  if (process.env.WGRAY_PAGE) await page.route(/(\.(js|css)|\/)$/, fromDisk);
  await page.goto(studio.url);
  return page;
}

// Serves the page from the folder WGRAY_PAGE, so that changes of the page need no build of the program.
function fromDisk(route) {
  const file = path.join(process.env.WGRAY_PAGE, path.basename(new URL(route.request().url()).pathname) || "index.html");
  return fs.existsSync(file) ? route.fulfill({ path: file }) : route.continue();
}

// Waits for a finished image that is newer than `oldRevision`. Returns the revision of the image.
export async function waitForImage(page, oldRevision = 0) {
  const handle = await page.waitForFunction((oldRevision) => {
    const { revision, done } = document.getElementById("panels").dataset;
    return done === "true" && Number(revision) > oldRevision ? Number(revision) : null;
  }, oldRevision);
  return handle.jsonValue();
}

// Waits until all commands of the page, and at least `commands` commands of all viewers, are executed and shown.
// Returns the number of executed commands.
export async function waitUntilSettled(page, commands = 0) {
  await page.waitForFunction((commands) => window.isSettled(commands), commands);
  return page.evaluate(() => Number(document.getElementById("panels").dataset.executed));
}

export function revision(page) {
  return page.evaluate(() => Number(document.getElementById("panels").dataset.revision));
}

export const canvas = (page, part = "picture") => page.locator(`[data-part=${part}] canvas`);

// Returns the input with index `nth` among the inputs of a value of the selected object.
export const control = (page, path, nth = 0) => page.locator(`[data-control="${path} ${nth}"]`);

export async function choose(page, name) {
  await page.fill("#object-find", name);
  await page.keyboard.press("Enter");
  await page.locator("#object-name", { hasText: name }).waitFor();
}

// Records the messages that a page sends. The returned function returns the relevant messages since its last call.
export async function recordMessages(page, isRelevant = () => true) {
  await page.evaluate(() => {
    const send = WebSocket.prototype.send;
    window.sent = [];
    WebSocket.prototype.send = function (text) {
      window.sent.push(JSON.parse(text));
      return send.call(this, text);
    };
  });
  return async () => (await page.evaluate(() => window.sent.splice(0))).filter(isRelevant);
}

// Returns the pixels on the page as [width, height, RGB bytes joined by commas].
export async function shownImage(page, part = "picture") {
  await page.click("#zoom-one");
  await page.waitForFunction((part) => document.querySelector(`[data-part=${part}] canvas`).dataset.scale === "1", part);
  return page.evaluate(async (part) => {
    await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
    const canvas = document.querySelector(`[data-part=${part}] canvas`);
    const [width, height] = document.getElementById("size").textContent.split(" × ").map(Number);
    const { left, top } = canvas.dataset;
    const { data } = canvas.getContext("2d").getImageData(Number(left), Number(top), width, height);
    return [width, height, data.filter((_, i) => i % 4 !== 3).join()];
  }, part);
}

// Returns the pixels of a PNG file in the format of `shownImage`.
export function decode(page, png) {
  return page.evaluate(async (png) => {
    const blob = new Blob([new Uint8Array(png)], { type: "image/png" });
    const image = await createImageBitmap(blob, { colorSpaceConversion: "none" });
    const context = new OffscreenCanvas(image.width, image.height).getContext("2d");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    return [image.width, image.height, data.filter((_, i) => i % 4 !== 3).join()];
  }, png);
}

// Fails with a short message unless two images are equal.
export function assertSameImage(actual, expected, message = "the images differ") {
  if (String(actual) === String(expected)) return;
  const [a, b] = [actual, expected].map(([, , bytes]) => bytes.split(","));
  const differing = [...a.keys()].filter((i) => a[i] !== b[i]);
  const [position] = differing;
  assert.fail(`${message}: sizes ${actual.slice(0, 2)} and ${expected.slice(0, 2)}; differing bytes: ${differing.length}, first at ${position}: ${a[position]} and ${b[position]}`);
}

// Waits until the page shows the image of `wgray render`.
export async function waitForRender(page, studio) {
  const expected = await decode(page, studio.render());
  const deadline = Date.now() + TIMEOUT;
  let actual;
  do {
    await waitForImage(page);
    actual = await shownImage(page);
    if (String(actual) === String(expected)) return;
    await page.waitForTimeout(50);
  } while (Date.now() < deadline);
  assertSameImage(actual, expected, "the page does not show the rendered image");
}
