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
