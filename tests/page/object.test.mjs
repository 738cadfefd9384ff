// Objects on the page: selection, edits with controls, and undo.

import assert from "node:assert/strict";
import { after, afterEach, before, beforeEach, test } from "node:test";

import { SCENE, Studio, TIMEOUT, canvas, launch, open, waitForRender, waitUntilSettled } from "./studio.mjs";

let browser;
let studio;

before(async () => (browser = await launch()));
after(() => browser.close());
beforeEach(async () => {
  studio = new Studio();
  await studio.start();
});
afterEach(async () => {
  await Promise.all(browser.contexts().map((context) => context.close()));
  await studio.remove();
});

const box = (page, path, nth = 0) => page.locator(`[data-control="${path} ${nth}"]`);

async function waitForSceneText(text) {
  const deadline = Date.now() + TIMEOUT;
  while (!studio.read("scene.toml").includes(text)) {
    assert.ok(Date.now() < deadline, `no ${text} in ${studio.read("scene.toml")}`);
    await new Promise((resolve) => setTimeout(resolve, 10));
  }
}

// Clicks a point of the canvas; `x` and `y` are fractions of its size.
async function click(page, x, y) {
  const area = await canvas(page).boundingBox();
  await page.mouse.click(area.x + area.width * x, area.y + area.height * y);
}

async function choose(page, name) {
  await page.fill("#object-find", name);
  await page.keyboard.press("Enter");
  await page.locator("#object-name", { hasText: name }).waitFor();
}

test("a click shows the object, and its controls write to the scene file", async () => {
  const page = await open(browser, studio);
  await click(page, 0.5, 0.5);
  await page.locator("#object-name", { hasText: "shapes[0]" }).waitFor();
  const lines = page.locator("#object-groups > details").first().locator("pre");
  const lineNumber = SCENE.split("\n").indexOf("[[shapes]]") + 1;
  assert.match(await lines.innerText(), new RegExp(`^ *${lineNumber}  \\[\\[shapes\\]\\]\\n`));
  // After a key press has changed the value, the box, the file and the displayed lines contain the new value.
  await box(page, "shapes[0].radius").focus();
  await page.keyboard.press("ArrowLeft");
  await page.locator("#undo-write", { hasText: "shapes[0].radius" }).waitFor();
  const radius = Number(await box(page, "shapes[0].radius", 1).inputValue());
  assert.ok(radius < 0.5 && radius > 0.4, `${radius}`);
  await waitForSceneText(`radius = ${radius}\n`);
  await lines.filter({ hasText: `radius = ${radius}` }).waitFor();
  await waitUntilSettled(page);
  await waitForRender(page, studio);
  // A color is set by linear numbers or as sRGB.
  await box(page, "materials.red.color", 1).fill("0.25");
  await page.keyboard.press("Enter");
  await waitForSceneText("color = [0.25, 0.1, 0.1]");
  await box(page, "materials.red.color").fill("#ffffff");
  await waitForSceneText("color = [1, 1, 1]");
  await page.locator("#undo-write", { hasText: "materials.red.color" }).waitFor();
  await box(page, "shapes[0].material").selectOption("grey");
  await waitForSceneText('center = [0, 0, 0.5]\nradius');
  await waitForSceneText('material = "grey"\ncenter = [0, 0, 0.5]');
  await page.locator('details[data-name="materials.grey"]').waitFor();
  assert.deepEqual(page.errors, []);
});

test("changes of the file are undone and redone by keys", async () => {
  const page = await open(browser, studio);
  await choose(page, "shapes[0]");
  await box(page, "shapes[0].center", 2).fill("0.75");
  await page.keyboard.press("Enter");
  await waitForSceneText("center = [0, 0, 0.75]");
  const textAfterFirstChange = studio.read("scene.toml");
  await box(page, "shapes[0].radius", 1).fill("0.25");
  await page.keyboard.press("Enter");
  await page.locator("#undo-write", { hasText: "shapes[0].radius" }).waitFor();
  // In a text box, the browser handles Ctrl+Z.
  await canvas(page).focus();
  await page.keyboard.press("Control+z");
  await page.locator("#redo-write", { hasText: "shapes[0].radius" }).waitFor();
  await waitUntilSettled(page);
  assert.equal(studio.read("scene.toml"), textAfterFirstChange);
  assert.equal(textAfterFirstChange, SCENE.replace("center = [0, 0, 0.5]", "center = [0, 0, 0.75]"));
  await page.keyboard.press("Control+Shift+z");
  await page.locator("#undo-write", { hasText: "shapes[0].radius" }).waitFor();
  assert.equal(studio.read("scene.toml"), textAfterFirstChange.replace("radius = 0.5", "radius = 0.25"));
});

test("an invalid value is reported at its control, and the file is unchanged", async () => {
  const page = await open(browser, studio);
  await choose(page, "shapes[0]");
  await box(page, "shapes[0].radius", 1).fill("-1");
  await page.keyboard.press("Enter");
  const error = page.locator('[data-path="shapes[0].radius"] .bad');
  await error.filter({ hasText: "must be from 1e-9 to 1e9" }).waitFor();
  assert.equal(studio.read("scene.toml"), SCENE);
  await box(page, "shapes[0].radius", 1).fill("0.25");
  await page.keyboard.press("Enter");
  await error.waitFor({ state: "hidden" });
  await waitForSceneText("radius = 0.25");
});

test("an object stays selected after reloads, and its removal is reported", async () => {
  const page = await open(browser, studio);
  await choose(page, "shapes[1]");
  studio.edit("scene.toml", "point = [0, 0, 0]", "point = [0, 0, -0.25]");
  await page.waitForFunction(() => document.querySelector('[data-control="shapes[1].point 2"]')?.value === "-0.25");
  studio.write("scene.toml", SCENE.slice(0, SCENE.lastIndexOf("[[shapes]]")));
  await page.locator("#object-note", { hasText: "shapes[1] is not in the scene" }).waitFor();
  studio.write("scene.toml", SCENE);
  await box(page, "shapes[1].point").waitFor();
});

test("number boxes are dragged and stepped, and each gesture is one undo step", async () => {
  const page = await open(browser, studio);
  await choose(page, "camera");
  const xBox = box(page, "camera.position", 0);
  await xBox.scrollIntoViewIfNeeded();
  const area = await xBox.boundingBox();
  const [left, top] = [area.x + area.width / 2, area.y + area.height / 2];
  // A drag by 10 pixels changes the value by one step, 0.1 here; with Shift, a step needs 100 pixels.
  await page.mouse.move(left, top);
  await page.mouse.down();
  for (const dx of [5, 20, 60, 100]) await page.mouse.move(left + dx, top);
  await page.keyboard.down("Shift");
  await page.mouse.move(left + 150, top);
  await page.keyboard.up("Shift");
  await page.mouse.up();
  await waitForSceneText("position = [1.05, -4, 1] # a comment");
  assert.equal(await xBox.inputValue(), "1.05");
  assert.equal(await xBox.evaluate((box) => box === document.activeElement), false);
  await waitUntilSettled(page);
  await page.locator("#undo-write", { hasText: "camera.position" }).click();
  await page.locator("#redo-write", { hasText: "camera.position" }).waitFor();
  assert.equal(studio.read("scene.toml"), SCENE);
  await page.waitForFunction(() => document.querySelector('[data-control="camera.position 0"]').value === "0");
  // Escape cancels the drag.
  await page.mouse.move(left, top);
  await page.mouse.down();
  await page.mouse.move(left + 40, top);
  await waitForSceneText("position = [0.4, -4, 1]");
  await page.keyboard.press("Escape");
  await waitForSceneText("position = [0, -4, 1]");
  await page.mouse.up();
  await page.waitForFunction(() => document.getElementById("undo-write").disabled);
  // A click focuses the box for typing.
  await page.mouse.click(left, top);
  assert.equal(await xBox.evaluate((box) => box === document.activeElement), true);
  // A held key is one undo step.
  for (let i = 0; i < 4; i++) await page.keyboard.down("ArrowUp");
  await page.keyboard.up("ArrowUp");
  await waitForSceneText("position = [0.4, -4, 1]");
  await page.keyboard.press("PageDown");
  await waitForSceneText("position = [-0.6, -4, 1]");
  await page.keyboard.press("Shift+ArrowUp");
  await waitForSceneText("position = [-0.59, -4, 1]");
  for (const text of ["-0.6", "0.4", "0"]) {
    await page.click("#undo-write");
    await waitForSceneText(`position = [${text}, -4, 1]`);
    await waitUntilSettled(page);
  }
  assert.equal(studio.read("scene.toml"), SCENE);
  // A held key is also one undo step right after a click.
  await xBox.evaluate(async (box) => {
    const fire = (EventType, type, options) => box.dispatchEvent(new EventType(type, { bubbles: true, ...options }));
    fire(PointerEvent, "pointerdown", { button: 1 });
    fire(PointerEvent, "pointerup", { button: 1 });
    fire(KeyboardEvent, "keydown", { key: "ArrowUp" });
    await new Promise((resolve) => setTimeout(resolve, 50));
    fire(KeyboardEvent, "keydown", { key: "ArrowUp", repeat: true });
    fire(KeyboardEvent, "keyup", { key: "ArrowUp" });
  });
  await waitForSceneText("position = [0.2, -4, 1]");
  await page.click("#undo-write");
  await waitForSceneText("position = [0, -4, 1]");
  assert.deepEqual(page.errors, []);
});

test("drags, keys and sliders send no value out of range", async () => {
  const page = await open(browser, studio);
  await page.evaluate(() => {
    const send = WebSocket.prototype.send;
    window.sent = [];
    WebSocket.prototype.send = function (text) {
      const { set } = JSON.parse(text);
      if (set) window.sent.push(set);
      return send.call(this, text);
    };
  });
  await choose(page, "shapes[0]");
  await box(page, "shapes[0].radius", 1).focus();
  for (let i = 0; i < 12; i++) await page.keyboard.press("PageDown");
  await page.locator("#undo-write", { hasText: "shapes[0].radius" }).waitFor();
  await choose(page, "lights[0]");
  const red = box(page, "lights[0].color", 1);
  await red.scrollIntoViewIfNeeded();
  const area = await red.boundingBox();
  await page.mouse.move(area.x + area.width / 2, area.y + area.height / 2);
  await page.mouse.down();
  for (let i = 1; i < 6; i++) await page.mouse.move(area.x + area.width / 2 - 60 * i, area.y + area.height / 2);
  await page.mouse.up();
  await page.waitForFunction(() => document.querySelector('[data-control="lights[0].color 1"]').value === "0.5");
  await red.focus();
  for (let i = 0; i < 7; i++) await page.keyboard.press("PageDown");
  await waitForSceneText("color = [0, 0.8, 0.8]");
  await waitUntilSettled(page);
  // The number of blades is 0 or at least 3; steps skip 1 and 2.
  await choose(page, "camera");
  await page.click("details.absent > summary");
  await box(page, "camera.blades", 1).focus();
  await page.keyboard.press("ArrowUp");
  await page.waitForFunction(() => window.sent.some(({ path }) => path === "camera.blades"));
  await waitUntilSettled(page);
  await box(page, "camera.blades", 1).focus();
  for (const key of ["ArrowUp", "ArrowDown", "ArrowDown"]) await page.keyboard.press(key);
  await page.waitForFunction(() => window.sent.at(-1).value === 0);
  await waitUntilSettled(page);
  const changes = await page.evaluate(() => window.sent);
  const otherChanges = changes.filter(({ path }) => path !== "camera.blades");
  const blades = changes.filter((set) => !otherChanges.includes(set)).map(({ value }) => value);
  assert.ok(blades[0] === 3 && blades.every((x) => x === 0 || x >= 3), `${blades}`);
  assert.ok(otherChanges.length >= 4); // at least the first and the last of each burst
  for (const { path, value } of otherChanges) {
    const [min, max] = path.endsWith("radius") ? [1e-9, 1e9] : [0, 1e6];
    for (const x of [value].flat()) assert.ok(x >= min && x <= max, `${path}: ${x}`);
  }
  // The parser of the scene checks a typed value.
  await choose(page, "lights[0]");
  await red.fill("-1");
  await page.keyboard.press("Enter");
  await page.locator('[data-path="lights[0].color"] .bad', { hasText: "-1 must be from 0 to" }).waitFor();
  assert.ok(studio.read("scene.toml").includes("color = [0, 0.8, 0.8]"));
});

test("one slider scales a light and keeps its tint", async () => {
  studio.edit("scene.toml", "color = [0.8, 0.8, 0.8]", "color = [2, 1, 0.5]");
  const page = await open(browser, studio);
  await choose(page, "lights[0]");
  const [slider, strength] = [4, 5].map((nth) => box(page, "lights[0].color", nth));
  assert.equal(await strength.inputValue(), "2");
  assert.ok(Number(await slider.getAttribute("max")) >= 4, "the range ends too close to the value");
  assert.equal(await slider.getAttribute("min"), "0");
  await slider.fill("4");
  await waitForSceneText("color = [4, 2, 1]");
  await page.locator("#undo-write", { hasText: "lights[0].color" }).waitFor();
  await slider.focus();
  await page.keyboard.press("Home");
  await waitForSceneText("color = [0, 0, 0]");
  await waitUntilSettled(page);
  await strength.fill("30");
  await page.keyboard.press("Enter");
  await waitForSceneText("color = [30, 15, 7.5]");
  await waitUntilSettled(page);
  // The slider's range extends beyond the value.
  await page.waitForFunction((slider) => Number(slider.max) >= 60, await slider.elementHandle());
  for (const text of ["[0, 0, 0]", "[4, 2, 1]", "[2, 1, 0.5]"]) {
    await page.click("#undo-write");
    await waitForSceneText(`color = ${text}`);
    await waitUntilSettled(page);
  }
  // A reflectance has no strength slider.
  await choose(page, "materials.red");
  assert.equal(await box(page, "materials.red.color", 3).count(), 1);
  assert.equal(await box(page, "materials.red.color", 4).count(), 0);
  assert.deepEqual(page.errors, []);
});

test("edits of a vector in the file survive a drag of one of its numbers", async () => {
  const page = await open(browser, studio);
  await choose(page, "shapes[0]");
  const xBox = box(page, "shapes[0].center");
  await xBox.scrollIntoViewIfNeeded();
  const area = await xBox.boundingBox();
  const dragStart = [area.x + area.width / 2, area.y + area.height / 2];
  const drag = async (dx) => {
    await page.mouse.move(dragStart[0], dragStart[1]);
    await page.mouse.down();
    await page.mouse.move(dragStart[0] + dx, dragStart[1]);
  };
  await drag(20);
  await waitForSceneText("center = [0.02, 0, 0.5]");
  studio.edit("scene.toml", "center = [0.02, 0, 0.5]", "center = [0.02, 0.25, 0.75]");
  await page.mouse.move(dragStart[0] + 40, dragStart[1]);
  await page.mouse.up();
  await waitForSceneText("center = [0.04, 0.25, 0.75]");
  // Edits of the file survive a cancelled drag, too.
  await waitUntilSettled(page);
  await drag(20);
  await waitForSceneText("center = [0.06, 0.25, 0.75]");
  studio.edit("scene.toml", "center = [0.06, 0.25, 0.75]", "center = [0.06, 0.5, 0.75]");
  await page.keyboard.press("Escape");
  await page.mouse.up();
  await waitForSceneText("center = [0.04, 0.5, 0.75]");
  await waitUntilSettled(page);
  // Each of several quick changes is one undo step.
  const errorCount = await page.evaluate(() => {
    const boxes = [0, 1, 2].map((i) => document.querySelector(`[data-control="shapes[0].center ${i}"]`));
    boxes.forEach((box, i) => {
      box.focus();
      box.value = String(i + 1);
      box.dispatchEvent(new Event("input", { bubbles: true }));
      box.dispatchEvent(new Event("change", { bubbles: true }));
    });
    return document.querySelectorAll("[data-path] [role=alert]:not([hidden])").length;
  });
  assert.equal(errorCount, 0);
  await waitForSceneText("center = [1, 2, 3]");
  for (const center of ["[1, 2, 0.75]", "[1, 0.5, 0.75]", "[0.04, 0.5, 0.75]"]) {
    await waitUntilSettled(page);
    await page.click("#undo-write");
    await waitForSceneText(`center = ${center}`);
  }
  assert.deepEqual(page.errors, []);
});
