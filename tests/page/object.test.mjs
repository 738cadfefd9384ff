// Objects on the page: clicked or named, changed by their controls, taken back.

import assert from "node:assert/strict";
import { after, afterEach, before, beforeEach, test } from "node:test";

import { LONGEST, SCENE, Studio, launch, open, settled, showsRendered } from "./studio.mjs";

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

// Waits until the scene file has a text.
async function holds(text) {
  const deadline = Date.now() + LONGEST;
  while (!studio.read("scene.toml").includes(text)) {
    assert.ok(Date.now() < deadline, `no ${text} in ${studio.read("scene.toml")}`);
    await new Promise((resolve) => setTimeout(resolve, 10));
  }
}

// Clicks a place of the picture, in shares of its canvas.
async function click(page, x, y) {
  const area = await page.locator("[data-part=picture] canvas").boundingBox();
  await page.mouse.click(area.x + area.width * x, area.y + area.height * y);
}

async function choose(page, name) {
  await page.fill("#object-find", name);
  await page.keyboard.press("Enter");
  await page.locator("#object-name", { hasText: name }).waitFor();
}

test("a click shows the object, and its controls write into the scene file", async () => {
  const page = await open(browser, studio);
  await click(page, 0.5, 0.5);
  await page.locator("#object-name", { hasText: "shapes[0]" }).waitFor();
  const lines = page.locator("#object-groups > details").first().locator("pre");
  const number = SCENE.split("\n").indexOf("[[shapes]]") + 1;
  assert.match(await lines.innerText(), new RegExp(`^ *${number}  \\[\\[shapes\\]\\]\\n`));
  // A slider by keys: the box, the file and the lines follow.
  await box(page, "shapes[0].radius").focus();
  await page.keyboard.press("ArrowLeft");
  await page.locator("#undo-write", { hasText: "shapes[0].radius" }).waitFor();
  const radius = Number(await box(page, "shapes[0].radius", 1).inputValue());
  assert.ok(radius < 0.5 && radius > 0.4, `${radius}`);
  await holds(`radius = ${radius}\n`);
  await lines.filter({ hasText: `radius = ${radius}` }).waitFor();
  await settled(page);
  await showsRendered(page, studio);
  // A colour, as linear light and as a display shows it.
  await box(page, "materials.red.color", 1).fill("0.25");
  await page.keyboard.press("Enter");
  await holds("color = [0.25, 0.1, 0.1]");
  await box(page, "materials.red.color").fill("#ffffff");
  await holds("color = [1, 1, 1]");
  // Keys that are absent are added, and go again.
  await page.locator("#undo-write", { hasText: "materials.red.color" }).waitFor();
  await box(page, "shapes[0].material").selectOption("grey");
  await holds('center = [0, 0, 0.5]\nradius');
  await holds('material = "grey"\ncenter = [0, 0, 0.5]');
  await page.locator('details[data-name="materials.grey"]').waitFor();
  assert.deepEqual(page.faults, []);
});

test("what was written is taken back and made again by keys", async () => {
  const page = await open(browser, studio);
  await choose(page, "shapes[0]");
  await box(page, "shapes[0].center", 2).fill("0.75");
  await page.keyboard.press("Enter");
  await holds("center = [0, 0, 0.75]");
  const once = studio.read("scene.toml");
  await box(page, "shapes[0].radius", 1).fill("0.25");
  await page.keyboard.press("Enter");
  await page.locator("#undo-write", { hasText: "shapes[0].radius" }).waitFor();
  // In a box of text the keys are the browser's own.
  await page.locator("[data-part=picture] canvas").focus();
  await page.keyboard.press("Control+z");
  await page.locator("#redo-write", { hasText: "shapes[0].radius" }).waitFor();
  await settled(page);
  assert.equal(studio.read("scene.toml"), once);
  assert.equal(once, SCENE.replace("center = [0, 0, 0.5]", "center = [0, 0, 0.75]"));
  await page.keyboard.press("Control+Shift+z");
  await page.locator("#undo-write", { hasText: "shapes[0].radius" }).waitFor();
  assert.equal(studio.read("scene.toml"), once.replace("radius = 0.5", "radius = 0.25"));
});

test("a value that breaks a rule is told at its control, and the file stays", async () => {
  const page = await open(browser, studio);
  await choose(page, "shapes[0]");
  await box(page, "shapes[0].radius", 1).fill("-1");
  await page.keyboard.press("Enter");
  const told = page.locator('[data-path="shapes[0].radius"] .bad');
  await told.filter({ hasText: "must be finite and greater than 0" }).waitFor();
  assert.equal(studio.read("scene.toml"), SCENE);
  await box(page, "shapes[0].radius", 1).fill("0.25");
  await page.keyboard.press("Enter");
  await told.waitFor({ state: "hidden" });
  await holds("radius = 0.25");
});

test("the object outlives reloads, and is told when it has gone", async () => {
  const page = await open(browser, studio);
  await choose(page, "shapes[1]");
  studio.edit("scene.toml", "point = [0, 0, 0]", "point = [0, 0, -0.25]");
  await page.waitForFunction(() => document.querySelector('[data-control="shapes[1].point 2"]')?.value === "-0.25");
  studio.write("scene.toml", SCENE.slice(0, SCENE.lastIndexOf("[[shapes]]")));
  await page.locator("#object-note", { hasText: "shapes[1] is not in the scene" }).waitFor();
  studio.write("scene.toml", SCENE);
  await box(page, "shapes[1].point").waitFor();
});

test("boxes of numbers are dragged and stepped, and each way is one step back", async () => {
  const page = await open(browser, studio);
  await choose(page, "camera");
  const x = box(page, "camera.position", 0);
  await x.scrollIntoViewIfNeeded();
  const area = await x.boundingBox();
  const [left, top] = [area.x + area.width / 2, area.y + area.height / 2];
  // Ten pixels are one step, a tenth of the position's size; with Shift a hundred are.
  await page.mouse.move(left, top);
  await page.mouse.down();
  for (const way of [5, 20, 60, 100]) await page.mouse.move(left + way, top);
  await page.keyboard.down("Shift");
  await page.mouse.move(left + 150, top);
  await page.keyboard.up("Shift");
  await page.mouse.up();
  await holds("position = [1.05, -4, 1] # a comment");
  assert.equal(await x.inputValue(), "1.05");
  assert.equal(await x.evaluate((box) => box === document.activeElement), false);
  await settled(page);
  await page.locator("#undo-write", { hasText: "camera.position" }).click();
  await page.locator("#redo-write", { hasText: "camera.position" }).waitFor();
  assert.equal(studio.read("scene.toml"), SCENE);
  await page.waitForFunction(() => document.querySelector('[data-control="camera.position 0"]').value === "0");
  // Escape gives the drag up.
  await page.mouse.move(left, top);
  await page.mouse.down();
  await page.mouse.move(left + 40, top);
  await holds("position = [0.4, -4, 1]");
  await page.keyboard.press("Escape");
  await holds("position = [0, -4, 1]");
  await page.mouse.up();
  await page.waitForFunction(() => document.getElementById("undo-write").disabled);
  // A click types, and the pointer then belongs to the text.
  await page.mouse.click(left, top);
  assert.equal(await x.evaluate((box) => box === document.activeElement), true);
  // A key that is held down is one step back, too.
  for (let i = 0; i < 4; i++) await page.keyboard.down("ArrowUp");
  await page.keyboard.up("ArrowUp");
  await holds("position = [0.4, -4, 1]");
  await page.keyboard.press("PageDown");
  await holds("position = [-0.6, -4, 1]");
  await page.keyboard.press("Shift+ArrowUp");
  await holds("position = [-0.59, -4, 1]");
  for (const text of ["-0.6", "0.4", "0"]) {
    await page.click("#undo-write");
    await holds(`position = [${text}, -4, 1]`);
    await settled(page);
  }
  assert.equal(studio.read("scene.toml"), SCENE);
  // So is one that follows a click at once.
  await x.evaluate(async (box) => {
    const fire = (Kind, type, more) => box.dispatchEvent(new Kind(type, { bubbles: true, ...more }));
    fire(PointerEvent, "pointerdown", { button: 1 });
    fire(PointerEvent, "pointerup", { button: 1 });
    fire(KeyboardEvent, "keydown", { key: "ArrowUp" });
    await new Promise((resolve) => setTimeout(resolve, 50));
    fire(KeyboardEvent, "keydown", { key: "ArrowUp", repeat: true });
    fire(KeyboardEvent, "keyup", { key: "ArrowUp" });
  });
  await holds("position = [0.2, -4, 1]");
  await page.click("#undo-write");
  await holds("position = [0, -4, 1]");
  assert.deepEqual(page.faults, []);
});

test("nothing out of range is sent by a drag, a key or a slider", async () => {
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
  await holds("color = [0, 0.8, 0.8]");
  await settled(page);
  // Of a lens a number of corners, 0 or 3 and more: what is between is passed over.
  await choose(page, "camera");
  await page.click("details.absent > summary");
  await box(page, "camera.blades", 1).focus();
  await page.keyboard.press("ArrowUp");
  await page.waitForFunction(() => window.sent.some(({ path }) => path === "camera.blades"));
  await settled(page);
  await box(page, "camera.blades", 1).focus();
  for (const key of ["ArrowUp", "ArrowDown", "ArrowDown"]) await page.keyboard.press(key);
  await page.waitForFunction(() => window.sent.at(-1).value === 0);
  await settled(page);
  const all = await page.evaluate(() => window.sent);
  const sent = all.filter(({ path }) => path !== "camera.blades");
  const blades = all.filter((set) => !sent.includes(set)).map(({ value }) => value);
  assert.ok(blades[0] === 3 && blades.every((x) => x === 0 || x >= 3), `${blades}`);
  assert.ok(sent.length >= 4); // of each burst the first and the last at least
  for (const { path, value } of sent) {
    const [low, high] = path.endsWith("radius") ? [1e-9, 1e9] : [0, 1e6];
    for (const x of [value].flat()) assert.ok(x >= low && x <= high, `${path}: ${x}`);
  }
  // A number that is typed goes to the scene's own reader, which says what is wrong.
  await choose(page, "lights[0]");
  await red.fill("-1");
  await page.keyboard.press("Enter");
  await page.locator('[data-path="lights[0].color"] .bad', { hasText: "-1 must be finite, from 0 to" }).waitFor();
  assert.ok(studio.read("scene.toml").includes("color = [0, 0.8, 0.8]"));
});

test("one slider makes a light stronger and weaker, and its tint stays", async () => {
  studio.edit("scene.toml", "color = [0.8, 0.8, 0.8]", "color = [2, 1, 0.5]");
  const page = await open(browser, studio);
  await choose(page, "lights[0]");
  const [slider, strength] = [4, 5].map((nth) => box(page, "lights[0].color", nth));
  assert.equal(await strength.inputValue(), "2");
  assert.ok(Number(await slider.getAttribute("max")) >= 4, "it goes well above what is there");
  assert.equal(await slider.getAttribute("min"), "0");
  await slider.fill("4");
  await holds("color = [4, 2, 1]");
  await page.locator("#undo-write", { hasText: "lights[0].color" }).waitFor();
  await slider.focus();
  await page.keyboard.press("Home");
  await holds("color = [0, 0, 0]");
  await settled(page);
  await strength.fill("30");
  await page.keyboard.press("Enter");
  await holds("color = [30, 15, 7.5]");
  await settled(page);
  // There is always room above.
  await page.waitForFunction((slider) => Number(slider.max) >= 60, await slider.elementHandle());
  for (const text of ["[0, 0, 0]", "[4, 2, 1]", "[2, 1, 0.5]"]) {
    await page.click("#undo-write");
    await holds(`color = ${text}`);
    await settled(page);
  }
  // What reflects has a share of light, and no strength.
  await choose(page, "materials.red");
  assert.equal(await box(page, "materials.red.color", 3).count(), 1);
  assert.equal(await box(page, "materials.red.color", 4).count(), 0);
  assert.deepEqual(page.faults, []);
});

test("what others change of a vector while one of its numbers is dragged stays", async () => {
  const page = await open(browser, studio);
  await choose(page, "shapes[0]");
  const x = box(page, "shapes[0].center");
  await x.scrollIntoViewIfNeeded();
  const area = await x.boundingBox();
  const at = [area.x + area.width / 2, area.y + area.height / 2];
  const drag = async (dx) => {
    await page.mouse.move(at[0], at[1]);
    await page.mouse.down();
    await page.mouse.move(at[0] + dx, at[1]);
  };
  await drag(20);
  await holds("center = [0.02, 0, 0.5]");
  studio.edit("scene.toml", "center = [0.02, 0, 0.5]", "center = [0.02, 0.25, 0.75]");
  await page.mouse.move(at[0] + 40, at[1]);
  await page.mouse.up();
  await holds("center = [0.04, 0.25, 0.75]");
  // Given up, too.
  await settled(page);
  await drag(20);
  await holds("center = [0.06, 0.25, 0.75]");
  studio.edit("scene.toml", "center = [0.06, 0.25, 0.75]", "center = [0.06, 0.5, 0.75]");
  await page.keyboard.press("Escape");
  await page.mouse.up();
  await holds("center = [0.04, 0.5, 0.75]");
  await settled(page);
  // Of quick hands every number counts, as a step of its own.
  const notes = await page.evaluate(() => {
    const boxes = [0, 1, 2].map((i) => document.querySelector(`[data-control="shapes[0].center ${i}"]`));
    boxes.forEach((box, i) => {
      box.focus();
      box.value = String(i + 1);
      box.dispatchEvent(new Event("input", { bubbles: true }));
      box.dispatchEvent(new Event("change", { bubbles: true }));
    });
    return document.querySelectorAll("[data-path] [role=alert]:not([hidden])").length;
  });
  assert.equal(notes, 0);
  await holds("center = [1, 2, 3]");
  for (const center of ["[1, 2, 0.75]", "[1, 0.5, 0.75]", "[0.04, 0.5, 0.75]"]) {
    await settled(page);
    await page.click("#undo-write");
    await holds(`center = ${center}`);
  }
  assert.deepEqual(page.faults, []);
});
