// The page's controls change no value by accident (for example by scrolling), and disabled controls show why they are
// disabled.

import assert from "node:assert/strict";
import fs from "node:fs";
import { after, afterEach, before, beforeEach, test } from "node:test";

import { SCENE, Studio, TIMEOUT, choose, control, launch, open, recordMessages, visit, waitUntilSettled } from "./studio.mjs";

let browser;
let studio;

before(async () => (browser = await launch()));
after(() => browser.close());
beforeEach(() => (studio = new Studio()));
afterEach(async () => {
  await Promise.all(browser.contexts().map((context) => context.close()));
  await studio.remove();
});

async function drag(page, dx = 60) {
  const area = await page.locator("#panels canvas").first().boundingBox();
  await page.mouse.move(area.x + area.width / 2, area.y + area.height / 2);
  await page.mouse.down();
  await page.mouse.move(area.x + area.width / 2 + dx, area.y + area.height / 2, { steps: 3 });
  await page.mouse.up();
  await waitUntilSettled(page);
}

async function waitForSceneText(text) {
  const deadline = Date.now() + TIMEOUT;
  while (!studio.read("scene.toml").includes(text)) {
    assert.ok(Date.now() < deadline, `no ${text} in ${studio.read("scene.toml")}`);
    await new Promise((resolve) => setTimeout(resolve, 10));
  }
}

const isChange = (message) => ["set", "look", "slide", "samples"].some((name) => message[name] !== undefined);

test("the wheel over a focused number box scrolls the panel and changes no value", async () => {
  await studio.start();
  for (const viewport of [{ width: 1200, height: 600 }, { width: 390, height: 844 }]) {
    const page = await open(browser, studio, { viewport });
    await choose(page, "shapes[0]");
    const sent = await recordMessages(page, isChange);
    const scrollPosition = () => page.evaluate(() => document.querySelector("aside").scrollTop + scrollY);
    for (const box of [control(page, "shapes[0].center"), page.locator("#exposure-number"), page.locator("#max-samples")]) {
      await box.scrollIntoViewIfNeeded();
      await box.click();
      assert.ok(await box.evaluate((box) => box === document.activeElement));
      const [value, oldPosition] = [await box.inputValue(), await scrollPosition()];
      await box.hover();
      const delta = oldPosition > 300 ? -100 : 100;
      for (let i = 0; i < 3; i++) await page.mouse.wheel(0, delta);
      await page.waitForFunction((oldPosition) => Math.abs(document.querySelector("aside").scrollTop + scrollY - oldPosition) > 100, oldPosition);
      assert.equal(await box.inputValue(), value);
      await page.locator("#pause").focus();
      assert.equal(await box.inputValue(), value);
    }
    await waitUntilSettled(page);
    assert.deepEqual(await sent(), []);
    assert.equal(studio.read("scene.toml"), SCENE);
    assert.deepEqual(page.errors, []);
    await page.context().close();
  }
});

test("a required key has no button that removes it", async () => {
  await studio.start();
  const page = await open(browser, studio);
  await choose(page, "camera");
  const buttons = page.locator('[data-name="camera"] > div .head button:visible');
  assert.equal(await buttons.count(), 0);
  await choose(page, "materials.red"); // a table with an optional key
  const optional = page.locator('[data-path="materials.red.shininess"] .head button');
  assert.match(await optional.getAttribute("title"), /^Remove shininess from the file/);
  assert.deepEqual(page.errors, []);
});

test("a scene that cannot be edited disables saving, shows the reason, and offers to copy the camera", async () => {
  const triangle = Buffer.alloc(44);
  [0, 0, 0, 1, 0, 0, 0, 1, 0].forEach((x, i) => triangle.writeFloatLE(x, 4 * i));
  studio.write("box.gltf", JSON.stringify({
    asset: { version: "2.0" }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 } }] }],
    accessors: [{ bufferView: 0, componentType: 5126, count: 3, type: "VEC3", min: [0, 0, 0], max: [1, 1, 0] }],
    bufferViews: [{ buffer: 0, byteLength: 36 }],
    buffers: [{ byteLength: 36, uri: `data:application/octet-stream;base64,${triangle.subarray(0, 36).toString("base64")}` }],
  }));
  await studio.start(0, ["--size", "60x45"], "box.gltf");
  const page = await open(browser, studio);
  await drag(page);
  await page.locator("#moved").waitFor();
  assert.ok(await page.locator("#save").isDisabled());
  assert.match(await page.locator("#save").getAttribute("title"), /glTF.*read-only.*wgray convert/);
  const isMain = (id) => page.locator(id).evaluate((button) => button.classList.contains("main"));
  assert.deepEqual([await isMain("#copy"), await isMain("#save")], [true, false]);
  assert.ok(await page.locator("#copy").isEnabled());
  // Positive control: a TOML scene can be saved.
  await studio.stop();
  await studio.start();
  const tomlPage = await open(browser, studio);
  await drag(tomlPage);
  assert.ok(await tomlPage.locator("#save").isEnabled());
  assert.deepEqual([await tomlPage.locator("#copy.main").count(), await tomlPage.locator("#save.main").count()], [0, 1]);
});

test("without a connection, nothing can be downloaded, and the zoom bar stays opaque", async () => {
  await studio.start();
  const page = await open(browser, studio);
  const links = ["#save-png", "#save-exr"].map((id) => page.locator(id));
  for (const link of links) assert.ok(await link.getAttribute("href"));
  await studio.stop();
  await page.locator("#badge.lost", { hasText: "Connection lost" }).waitFor();
  for (const link of links) {
    assert.equal(await link.getAttribute("aria-disabled"), "true");
    assert.equal(await link.getAttribute("href"), null);
  }
  assert.equal(await page.locator("#zooming").evaluate((bar) => getComputedStyle(bar).opacity), "1");
  await page.click("#zoom-in");
  await page.locator("#zoom", { hasText: /^\d+%$/ }).waitFor();
  await studio.start(studio.port);
  await page.locator("#save-png[href]").waitFor();
  // These controls stay disabled: there is nothing to reset, to undo or to save.
  for (const id of ["#reset-look", "#undo-write", "#reset-sliders", "#save"]) assert.ok(await page.locator(id).isDisabled(), id);
});

test("the undo button shows why undo is not possible after another program has changed the file", async () => {
  await studio.start();
  const page = await open(browser, studio);
  await choose(page, "shapes[0]");
  assert.equal(await page.locator("#undo-write").getAttribute("title"), "Nothing to undo");
  await control(page, "shapes[0].radius", 1).fill("0.25");
  await page.keyboard.press("Enter");
  await page.locator('#undo-write[title="Undo shapes[0].radius (Ctrl+Z)"]').waitFor();
  await waitUntilSettled(page);
  studio.edit("scene.toml", "# a small scene", "# another");
  await page.locator("#undo-write:disabled").waitFor();
  assert.match(await page.locator("#undo-write").getAttribute("title"), /^Undo is not possible: scene\.toml was changed by another program/);
  await page.locator("#pause").focus();
  await page.keyboard.press("Control+z");
  await page.locator("#notice.bad", { hasText: "Undo is not possible" }).waitFor();
  // The next change can be undone again.
  await control(page, "shapes[0].radius", 1).fill("0.35");
  await page.keyboard.press("Enter");
  await page.locator("#undo-write:enabled").click();
  await waitForSceneText("radius = 0.25");
  assert.deepEqual(page.errors, []);
});

test("exposure out of range is reported, and its slider and box agree", async () => {
  await studio.start();
  const page = await open(browser, studio);
  const [box, slider] = [page.locator("#exposure-number"), page.locator("#exposure")];
  for (const [typed, expected] of [["500", "100"], ["-700", "-100"], ["500", "100"], ["12.5", "12.5"]]) {
    await box.fill(typed);
    await page.keyboard.press("Enter");
    await waitUntilSettled(page);
    const notice = page.locator("#notice.bad", { hasText: `from -100 to 100 stops: ${typed} became ${expected}` });
    if (typed !== expected) await notice.waitFor();
    else await page.locator("#notice").waitFor({ state: "hidden" });
    assert.deepEqual([await box.inputValue(), await slider.inputValue()], [expected, expected]);
  }
  await box.fill("-0.79435");
  await page.keyboard.press("Enter");
  await waitUntilSettled(page);
  await page.locator("#pause").focus();
  const freeWidth = await box.evaluate((box) => {
    const { font, paddingLeft, paddingRight } = getComputedStyle(box);
    const context = new OffscreenCanvas(1, 1).getContext("2d");
    context.font = font;
    return box.clientWidth - parseFloat(paddingLeft) - parseFloat(paddingRight) - context.measureText(box.value).width;
  });
  assert.ok(freeWidth >= 0, `the box is ${-freeWidth} pixels too narrow for the digits`);
});

test("after the view has moved, a note explains that the camera's values are those of the file", async () => {
  await studio.start();
  const page = await open(browser, studio);
  await choose(page, "camera");
  const note = page.locator("#object-note");
  assert.equal(await note.textContent(), "");
  await drag(page);
  await note.filter({ hasText: "The view has moved" }).waitFor();
  await page.click("#reset");
  await page.waitForFunction(() => document.getElementById("object-note").textContent === "");
  await drag(page);
  await choose(page, "shapes[0]");
  await page.waitForFunction(() => document.getElementById("object-note").textContent === "");
});

test("an invalid shader at the start is reported as an error", async () => {
  studio.breakShader();
  await studio.start();
  const page = await visit(browser, studio);
  await page.locator("#badge.lost", { hasText: /^Shader error\. No image yet$/ }).waitFor();
  studio.fixShader();
  await page.locator("#badge.live").waitFor({ state: "attached" });
  assert.ok(fs.existsSync(studio.path("scene.toml")));
});
