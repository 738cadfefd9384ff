// The page of `wgray dev` in a real browser.

import assert from "node:assert/strict";
import http from "node:http";
import { after, afterEach, before, beforeEach, test } from "node:test";

import { SCENE, Studio, TIMEOUT, assertSameImage, canvas, decode, launch, open, revision, shownImage, waitForImage, waitForRender, waitUntilSettled } from "./studio.mjs";

let browser;
let studio;

before(async () => (browser = await launch(["--host-resolver-rules=MAP evil.example 127.0.0.1"])));
after(() => browser.close());
beforeEach(async () => {
  studio = new Studio();
  await studio.start();
});
afterEach(async () => {
  await Promise.all(browser.contexts().map((context) => context.close()));
  await studio.remove();
});

const text = (page, selector) => page.locator(selector).innerText();

async function drag(page, dx, dy, modifier) {
  const box = await canvas(page).boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  if (modifier) await page.keyboard.down(modifier);
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + dx, y + dy, { steps: 4 });
  await page.mouse.up();
  if (modifier) await page.keyboard.up(modifier);
}

test("the image equals the image of wgray render", async () => {
  const page = await open(browser, studio);
  await waitForRender(page, studio);
  assert.equal(await text(page, "#samples"), "4 of 4");
  assert.equal(await page.locator("#badge.live").count(), 1);
  // Negative control: the images of two scenes differ.
  const oldImage = await decode(page, studio.render());
  studio.edit("scene.toml", "fov = 40", "fov = 42");
  assert.notDeepEqual(await decode(page, studio.render()), oldImage);
  await waitForRender(page, studio);
  assert.deepEqual(page.errors, []);
});

test("a saved shader changes the image", async () => {
  const page = await open(browser, studio);
  const [oldImage, oldRevision] = [await shownImage(page), await revision(page)];
  studio.redden();
  await waitForImage(page, oldRevision);
  const [, , reddened] = await shownImage(page);
  const bytes = reddened.split(",").map(Number);
  assert.ok(bytes.every((value, i) => i % 3 === 0 || value === 0), "green or blue is not zero");
  const red = (data) => data.split(",").filter((_, i) => i % 3 === 0);
  assert.deepEqual(red(reddened), red(oldImage[2]));
});

test("a shader error shows its file and line, and the image stays until the shader is fixed", async () => {
  const page = await open(browser, studio);
  const oldImage = await shownImage(page);
  studio.breakShader();
  const location = `shaders/kernels/render.wgsl:${studio.errorLine()}:`;
  await page.locator("#problems h2", { hasText: location }).waitFor();
  assert.match(await text(page, "#problems"), /simple/);
  assert.match(await text(page, "#problems pre"), /\^\^\^\^\^\^/);
  assert.match(await page.title(), /^✗/);
  await page.waitForTimeout(500);
  assertSameImage(await shownImage(page), oldImage);
  studio.fixShader();
  await page.locator("#problems h2").waitFor({ state: "detached" });
  await waitForRender(page, studio);
  assert.match(studio.stderr, new RegExp(`error: ${location.replaceAll(".", "\\.")}\\d+: .*simple`));
  assert.doesNotMatch(studio.stderr, /\x1b/, "a pipe received color codes");
});

test("an invalid scene is reported with its line", async () => {
  const page = await open(browser, studio);
  studio.edit("scene.toml", "radius = 0.5", "radius = -0.5");
  await page.locator("#problems h2", { hasText: /scene\.toml:\d+:\d+$/ }).waitFor();
  assert.match(await text(page, "#problems pre"), /radius = -0\.5/);
  studio.write("scene.toml", SCENE);
  await page.locator("#problems h2").waitFor({ state: "detached" });
});

test("all errors of a scene are shown", async () => {
  const page = await open(browser, studio);
  studio.write("scene.toml", SCENE.replace("fov = 40", "fov = 190").replace("shininess = 16", "shininess = -1"));
  await page.locator("#problems h2").nth(1).waitFor();
  const articles = await page.locator("#problems article").allInnerTexts();
  assert.equal(articles.length, 2);
  assert.match(articles[0], /scene\.toml:9:7\n+camera\.fov: 190 must be[^]*fov = 190\n.*\^\^\^/);
  assert.match(articles[1], /scene\.toml:19:13\n+materials\.red\.shininess: -1 must be/);
  assert.match(await text(page, "#problems summary"), /2 problems/);
  studio.write("scene.toml", SCENE);
  await page.locator("#problems h2").first().waitFor({ state: "detached" });
});

test("while a file is being written, the page reports that files are being read", async () => {
  const page = await open(browser, studio);
  studio.write("box.obj", "v 0 0 0\n");
  studio.write("scene.toml", `${SCENE}\n[[shapes]]\ntype = "mesh"\nfile = "box.obj"\nmaterial = "red"\n`);
  await page.locator("#problems h2").waitFor();
  assert.equal(await text(page, "#problems summary"), "1 problem");
  const start = Date.now();
  let isReading = false;
  for (let i = 0; !isReading && Date.now() - start < TIMEOUT; i++) {
    studio.write("box.obj", "v 0 0 0\n".repeat(i));
    await page.waitForTimeout(20);
    isReading = await page.evaluate(() =>
      document.querySelector("#problems summary").textContent === "1 problem. Reading the changed files…" &&
      document.querySelector("#badge").textContent === "Reading files…");
  }
  assert.ok(isReading);
  studio.write("box.obj", "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n");
  await page.locator("#problems h2").waitFor({ state: "detached" });
  studio.write("scene.toml", SCENE);
  await waitForRender(page, studio);
});

test("drags move the camera, and saving writes what the page shows", async () => {
  const page = await open(browser, studio);
  const start = await text(page, "#camera-text");
  assert.ok(await page.locator("#save").isDisabled());
  let cameraText = start;
  for (const [modifier, dx, dy] of [[null, 90, 30], ["Shift", 30, -20], ["Control", 0, 40]]) {
    await drag(page, dx, dy, modifier);
    await waitUntilSettled(page);
    assert.notEqual(await text(page, "#camera-text"), cameraText);
    cameraText = await text(page, "#camera-text");
  }
  const savedImage = await shownImage(page);
  await page.click("#save");
  await page.locator("#notice", { hasText: "Camera saved to scene.toml" }).waitFor();
  await page.locator("#save:disabled").waitFor();
  assertSameImage(await decode(page, studio.render()), savedImage);
  const saved = studio.read("scene.toml");
  for (const expected of ["# a small scene\n", "[camera] # from the front\n", "] # a comment\n"]) {
    assert.ok(saved.includes(expected), saved);
  }
  for (const line of cameraText.split("\n").filter((line) => /^(position|look_at)/.test(line))) {
    assert.ok(saved.includes(line), `${line} is not in ${saved}`);
  }
  assert.equal(await text(page, "#camera-text"), cameraText);
  assert.deepEqual(page.errors, []);
});

test("the camera is copied as text and reset", async () => {
  const page = await open(browser, studio, { permissions: ["clipboard-read", "clipboard-write"] });
  const start = await text(page, "#camera-text");
  await drag(page, 60, 0);
  await page.locator("#reset:enabled").waitFor();
  await waitUntilSettled(page);
  await page.click("#copy");
  await page.locator("#notice", { hasText: "camera copied" }).waitFor();
  const copied = await page.evaluate(() => navigator.clipboard.readText());
  assert.equal(copied.trim(), (await text(page, "#camera-text")).trim());
  assert.match(copied, /^\[camera\]\nposition = \[/);
  assert.notEqual(copied.trim(), start.trim());
  await page.click("#reset");
  await page.locator("#reset:disabled").waitFor();
  assert.equal(await text(page, "#camera-text"), start);
});

test("the linear value of the pixel under the pointer is shown", async () => {
  const page = await open(browser, studio);
  const [width, , bytes] = await shownImage(page);
  const image = canvas(page);
  const { left, top } = await image.evaluate((canvas) => ({ ...canvas.dataset }));
  await image.hover({ position: { x: Number(left) + 60.5, y: Number(top) + 45.5 } });
  await page.locator("#values", { hasText: "pixel 60 45" }).waitFor();
  const linear = /linear RGB ([\d.e+-]+) +([\d.e+-]+) +([\d.e+-]+)/.exec(await text(page, "#values"));
  const shown = /shown (\d+) (\d+) (\d+)/.exec(await text(page, "#values"));
  const encoded = linear.slice(1).map((v) => Math.round(255 * Math.min(1, Number(v)) ** (1 / 2.2)));
  const start = 3 * (45 * width + 60);
  assert.deepEqual(encoded, bytes.split(",").slice(start, start + 3).map(Number));
  assert.deepEqual(shown.slice(1).map(Number), encoded);
});

test("all views differ, and the GPU agrees with the CPU", async () => {
  const page = await open(browser, studio);
  const images = new Set([String(await shownImage(page))]);
  for (const [i, view] of ["normal", "depth", "uv", "primitive", "samples"].entries()) {
    await page.keyboard.press(String(i + 2));
    await page.waitForFunction((view) => {
      const state = document.getElementById("panels").dataset;
      return state.view === view && state.done === "true";
    }, view);
    assert.ok(await page.locator(`input[value=${view}]`).isChecked());
    images.add(String(await shownImage(page)));
  }
  assert.equal(images.size, 6, "two views are equal");
  for (const layer of ["shading_normal", "instance"]) {
    await page.selectOption("#layers", layer);
    await page.waitForFunction((view) => document.getElementById("panels").dataset.view === view, layer);
    await waitUntilSettled(page);
    assert.equal(await page.locator("input[name=view]:checked").count(), 0);
  }
  await page.getByLabel("Compare", { exact: true }).check();
  await page.locator("#differing", { hasText: /^0 pixels differ: all bits are the same$/ }).waitFor();
  assertSameImage(await shownImage(page, "first"), await shownImage(page, "second"));
  const captions = await page.locator("figure:not([hidden]) figcaption").allInnerTexts();
  assert.deepEqual(captions, ["GPU", "CPU", "Difference × 256"]);
  assert.match((await shownImage(page, "difference"))[2], /^[0,]+$/);
  studio.redden();
  await page.locator("#differing", { hasText: /^[\d,]+ pixels differ, by at most 0\.\d+$/ }).waitFor();
  await page.selectOption("#gain", "1");
  await waitUntilSettled(page);
  assert.equal(await text(page, "[data-part=difference] figcaption"), "Difference × 1");
  const faintDifference = await shownImage(page, "difference");
  await page.selectOption("#gain", "4096");
  await waitUntilSettled(page);
  assert.notDeepEqual(await shownImage(page, "difference"), faintDifference);
  assert.deepEqual(page.errors, []);
});

test("a second viewer sees the same image and the first viewer's moves", async () => {
  const [first, second] = [await open(browser, studio), await open(browser, studio)];
  assertSameImage(await shownImage(second), await shownImage(first));
  const oldRevision = await revision(second);
  await drag(first, 80, 10);
  await waitForImage(second, oldRevision);
  await second.locator("#moved").waitFor();
  await waitUntilSettled(second, await waitUntilSettled(first));
  assert.equal(await text(second, "#camera-text"), await text(first, "#camera-text"));
  assertSameImage(await shownImage(second), await shownImage(first));
});

test("the page reconnects when the program restarts", async () => {
  const page = await open(browser, studio);
  const { port } = studio;
  await studio.stop();
  await page.locator("#badge.lost", { hasText: "connection lost" }).waitFor();
  for (const control of ["#restart", "#copy", "#exposure", "input[value=normal]"]) assert.ok(await page.locator(control).isDisabled(), control);
  studio.edit("scene.toml", "fov = 40", "fov = 55");
  await studio.start(port);
  await page.locator("#badge.live").waitFor({ state: "attached" });
  assert.ok(await page.locator("#restart").isEnabled());
  await waitForRender(page, studio);
});

test("all controls can be reached and operated by the keyboard", async () => {
  const page = await open(browser, studio);
  const start = await text(page, "#camera-text");
  const focused = () => page.evaluate(() => `${document.activeElement.tagName} ${document.activeElement.id || document.activeElement.value || ""}`.trim());
  const focusStops = [];
  for (let i = 0; i < 30; i++) {
    await page.keyboard.press("Tab");
    focusStops.push(await focused());
  }
  for (const expected of ["CANVAS", "INPUT color", "INPUT orbit", "BUTTON zoom-in", "BUTTON copy", "SUMMARY", "INPUT exposure", "SELECT layers"]) {
    assert.ok(focusStops.includes(expected), `${expected} is not in ${focusStops}`);
  }
  await canvas(page).focus();
  let last = start;
  for (const key of ["ArrowLeft", "Shift+ArrowUp", "PageUp"]) {
    await page.keyboard.press(key);
    await page.waitForFunction((last) => document.getElementById("camera-text").innerText !== last, last);
    last = await text(page, "#camera-text");
  }
  await page.keyboard.press("l");
  await page.locator("#values", { hasText: /pixel 61 45 .*linear RGB/ }).waitFor();
  await page.keyboard.press("+");
  await page.locator("#zoom", { hasText: /^\d+%$/ }).waitFor();
  await page.keyboard.press("0");
  await page.locator("#zoom", { hasText: /^Fit/ }).waitFor();
  await page.keyboard.press("r");
  await page.locator("#reset:disabled").waitFor();
  assert.equal(await text(page, "#camera-text"), start);
});

test("the wheel with Ctrl zooms about the pointer, and the hand tool pans the image", async () => {
  const page = await open(browser, studio);
  const image = canvas(page);
  const view = () => image.evaluate((canvas) => ["left", "top", "scale"].map((key) => Number(canvas.dataset[key])));
  await shownImage(page);
  const [left, top] = await view();
  const box = await image.boundingBox();
  await page.mouse.move(box.x + left + 30, box.y + top + 20);
  await page.keyboard.down("Control");
  await page.mouse.wheel(0, -400);
  await page.keyboard.up("Control");
  await page.waitForFunction(() => Number(document.querySelector("#panels canvas").dataset.scale) > 2);
  const [newLeft, newTop, scale] = await view();
  assert.ok(Math.abs(newLeft + 30 * scale - (left + 30)) <= 1 && Math.abs(newTop + 20 * scale - (top + 20)) <= 1);
  await page.getByLabel("Pan image").check();
  const camera = await text(page, "#camera-text");
  await drag(page, 50, 0);
  await page.waitForFunction((old) => Number(document.querySelector("#panels canvas").dataset.left) > old + 40, newLeft);
  assert.equal(await text(page, "#camera-text"), camera, "the camera moved");
});

test("the page fits a width of 360 pixels in the light and the dark theme", async () => {
  const colors = [];
  for (const colorScheme of ["light", "dark"]) {
    const page = await open(browser, studio, { viewport: { width: 360, height: 700 }, colorScheme });
    const pageWidth = await page.evaluate(() => document.scrollingElement.scrollWidth);
    assert.ok(pageWidth <= 360, `the page is ${pageWidth} pixels wide`);
    for (const id of ["save", "copy", "reset", "zoom-fit"]) {
      const box = await page.locator(`#${id}`).boundingBox();
      assert.ok(box.x >= 0 && box.x + box.width <= 360, `${id}: ${JSON.stringify(box)}`);
    }
    studio.breakShader();
    // A problem of a partly written file may precede this problem.
    const problem = page.locator("#problems article", { hasText: "simple" });
    await problem.waitFor();
    const box = await problem.boundingBox();
    assert.ok(box.x >= 0 && box.x + box.width <= 360, JSON.stringify(box));
    studio.fixShader();
    await problem.waitFor({ state: "detached" });
    colors.push(await page.evaluate(() => getComputedStyle(document.body).backgroundColor));
  }
  assert.notEqual(colors[0], colors[1]);
});

test("pages of other origins are rejected", async () => {
  // The host is another name for the same address, as after DNS rebinding.
  const context = await browser.newContext();
  const page = await context.newPage();
  const response = await page.goto(`http://evil.example:${studio.port}/`);
  assert.equal(response.status(), 403);
  // A WebSocket from a page of another origin is rejected. Positive control: a WebSocket from the program's page
  // connects.
  const connects = (url) =>
    new Promise((resolve) => {
      const socket = new WebSocket(url);
      socket.onopen = () => resolve(true);
      socket.onerror = () => resolve(false);
    });
  const server = http.createServer((_, response) => response.end("<!doctype html><title>elsewhere</title>"));
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  try {
    const socketUrl = `ws://127.0.0.1:${studio.port}/socket`;
    await page.goto(`http://127.0.0.1:${server.address().port}/`);
    assert.equal(await page.evaluate(connects, socketUrl), false);
    const programPage = await open(browser, studio);
    assert.equal(await programPage.evaluate(connects, socketUrl), true);
  } finally {
    server.closeAllConnections();
    server.close();
  }
});

test("all errors are shown at once, including errors in unused kernels", async () => {
  const page = await open(browser, studio);
  const oldImage = await shownImage(page);
  studio.breakShader();
  studio.edit("shaders/kernels/render.wgsl", "@workgroup_size(8, 8)", "@workgroup_size(4, 4)");
  studio.edit("shaders/kernels/first_hits.wgsl", "fn first_hits", "fn hits_first");
  studio.edit("shaders/kernels/adaptive.wgsl", "= moments;", "= moments.xyz;");
  const waitForProblem = (message) => page.locator("#problems article", { hasText: message }).waitFor();
  for (const message of ["simple", "(4, 4)", "must be called `first_hits`", "`moments.xyz` (`vec3<f32>`)"]) await waitForProblem(message);
  assert.equal(await page.locator("#problems article").count(), 4);
  assertSameImage(await shownImage(page), oldImage);
  // The session continues.
  const oldRevision = await revision(page);
  await canvas(page).focus();
  await page.keyboard.press("ArrowLeft");
  await waitForImage(page, oldRevision);
  await page.getByLabel("Normal").check();
  await waitUntilSettled(page);
  assert.notDeepEqual(await shownImage(page), oldImage);
});

test("invalid pixels are marked and counted", async () => {
  const page = await open(browser, studio);
  const oldImage = await shownImage(page);
  assert.ok(await page.locator("#faults").isHidden());
  const invalidPixels = `let zero = f32(params.samples.x) * 0.0;
    if pixel.y == 3u && pixel.x == 0u { sum.x = zero / zero; }
    if pixel.y == 3u && pixel.x == 1u { sum.x = 1.0 / zero; }
    if pixel.y == 3u && pixel.x == 2u { sum.x = -1.0 / zero; }
    if pixel.y == 80u { sum.z = -1.0; }
    film[index] = sum;`;
  studio.edit("shaders/kernels/render.wgsl", "film[index] = sum;", invalidPixels);
  const counts = page.locator("#fault-counts");
  await page.locator("#fault-counts", { hasText: "pixels: 1 NaN, 2 infinite, 120 negative" }).waitFor();
  await waitUntilSettled(page);
  const pixelAt = (image, x, y) => image[2].split(",").slice(3 * (y * 120 + x), 3 * (y * 120 + x) + 3).join();
  const markColors = await page.evaluate(() => [...document.querySelectorAll("#faults b")].map((b) => getComputedStyle(b).backgroundColor));
  assert.deepEqual(markColors, ["rgb(255, 0, 255)", "rgb(0, 255, 255)", "rgb(0, 255, 0)"]);
  await page.click("#zoom-in");
  const displayedPixel = async (x, y) => {
    await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
    return page.evaluate(([x, y]) => {
      const canvas = document.querySelector("#panels canvas");
      const { left, top, scale } = Object.fromEntries(Object.entries(canvas.dataset).map(([key, value]) => [key, Number(value)]));
      const position = [left + (x + 0.5) * scale, top + (y + 0.5) * scale].map((v) => Math.round(v * devicePixelRatio));
      return [...canvas.getContext("2d").getImageData(...position, 1, 1).data.slice(0, 3)].join();
    }, [x, y]);
  };
  await page.click("#zoom-fit");
  assert.deepEqual([await displayedPixel(0, 3), await displayedPixel(1, 3), await displayedPixel(2, 3), await displayedPixel(60, 80)],
    ["255,0,255", "0,255,255", "0,255,255", "0,255,0"]);
  assertSameImage([...(await shownImage(page)).slice(0, 2), pixelAt(await shownImage(page), 8, 3)], [120, 90, pixelAt(oldImage, 8, 3)], "many invalid pixels have rings");
  await page.uncheck("#marks");
  await waitUntilSettled(page);
  const unmarked = await shownImage(page);
  assert.equal(pixelAt(unmarked, 8, 3), pixelAt(oldImage, 8, 3));
  assert.equal(pixelAt(unmarked, 60, 45), pixelAt(oldImage, 60, 45));
  assert.match(await counts.innerText(), /1 NaN/, "invalid pixels are not counted");
  await page.check("#marks");
  await page.getByLabel("Compare", { exact: true }).check();
  await page.locator("#fault-counts", { hasText: /pixels: GPU: 1 NaN, 2 infinite, 120 negative$/ }).waitFor();
  assert.deepEqual(page.errors, []);
});

test("a save can be undone, and keeps line endings and a byte-order mark", async () => {
  const encode = (scene) => `\u{feff}${scene.replaceAll("\n", "\r\n")}`;
  studio.write("scene.toml", encode(SCENE));
  const page = await open(browser, studio);
  await drag(page, 90, 30);
  await waitUntilSettled(page);
  const camera = await text(page, "#camera-text");
  assert.ok(await page.locator("#undo").isHidden());
  await page.click("#save");
  await page.locator("#undo").waitFor();
  await page.locator("#save:disabled").waitFor();
  const saved = studio.read("scene.toml");
  assert.equal(saved.replace(/position = \[[^\]]*\]/, "position = [0, -4, 1]"), encode(SCENE));
  assert.notEqual(saved, encode(SCENE));
  await page.click("#undo");
  await page.locator("#undo").waitFor({ state: "hidden" });
  assert.equal(studio.read("scene.toml"), encode(SCENE));
  await page.locator("#save:enabled").waitFor();
  assert.equal(await text(page, "#camera-text"), camera, "undoing a save moved the view");
  // If the file is edited after a save, the save cannot be undone.
  await page.click("#save");
  await page.locator("#undo").waitFor();
  studio.edit("scene.toml", "fov = 40", "fov = 41");
  await page.locator("#undo").waitFor({ state: "hidden" });
});

test("an edited field of view keeps a moved camera", async () => {
  const page = await open(browser, studio);
  await drag(page, 90, 30);
  await waitUntilSettled(page);
  const camera = await text(page, "#camera-text");
  studio.edit("scene.toml", "fov = 40", "fov = 55");
  await page.locator("#camera-text", { hasText: "fov = 55" }).waitFor();
  assert.equal(await text(page, "#camera-text"), camera.replace("fov = 40", "fov = 55"));
});

test("an image that is too large is shown smaller with a message", async () => {
  studio.edit("scene.toml", "count = 4 }", "count = 1 }");
  for (const [size, reducedSize] of [["3000x3000", /^\d+ × \d+$/], ["65536x1", /^16384 × 1$/], ["1x65536", /^1 × 16384$/]]) {
    await studio.stop();
    await studio.start(0, ["--size", size]);
    const page = await open(browser, studio);
    await waitUntilSettled(page);
    assert.equal(await text(page, "#size"), size.replace("x", " × "));
    const isFullSize = await page.locator("#smaller").isHidden(); // a device with enough memory shows the full image
    if (!isFullSize || size !== "3000x3000") assert.match(await text(page, "#smaller"), reducedSize);
    if (!isFullSize) assert.match(studio.stderr, /too large to display; showing \d+ x \d+/);
    await page.click("#zoom-one");
    await waitUntilSettled(page);
    const colors = await page.evaluate(() => {
      const canvas = document.querySelector("#panels canvas");
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      return new Set(new Uint32Array(data.buffer)).size;
    });
    assert.ok(colors >= 2, `${size}: nothing is drawn`);
    assert.deepEqual(page.errors, []);
    await page.context().close();
  }
});

test("a saved change is shown within seconds", async (t) => {
  const page = await open(browser, studio);
  const oldRevision = await revision(page);
  const start = Date.now();
  studio.edit("scene.toml", "0.8, 0.1, 0.1", "0.1, 0.1, 0.8");
  await page.waitForFunction((oldRevision) => Number(document.getElementById("panels").dataset.revision) > oldRevision, oldRevision, { polling: 5 });
  const elapsed = Date.now() - start;
  t.diagnostic(`${elapsed} ms until the saved change is shown`);
  assert.ok(elapsed < TIMEOUT / 10, `${elapsed} ms`);
});
