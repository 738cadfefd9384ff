// Input fields of the page: half-typed numbers, touch, keys and focus.

import assert from "node:assert/strict";
import { after, afterEach, before, beforeEach, test } from "node:test";

import { SCENE, Studio, TIMEOUT, canvas, decode, launch, open, visit, waitUntilSettled } from "./studio.mjs";

const KERNEL = "shaders/kernels/render.wgsl";
const LEVEL = "override level: f32 = 0.5; // 0..1\n";
const PHONE = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true };

let browser;
let studio;
let kernel;

before(async () => (browser = await launch()));
after(() => browser.close());
beforeEach(async () => {
  studio = new Studio();
  studio.edit(KERNEL, "path_value(path)", "(path_value(path) * level)");
  kernel = studio.read(KERNEL);
  appendToKernel(LEVEL);
  await studio.start();
});
afterEach(async () => {
  await Promise.all(browser.contexts().map((context) => context.close()));
  await studio.remove();
});

const appendToKernel = (lines) => studio.write(KERNEL, kernel + lines);
const box = (page, path, nth = 0) => page.locator(`[data-control="${path} ${nth}"]`);
const slider = (page, name) => page.getByRole("slider", { name, exact: true });
const number = (page, name) => page.getByRole("spinbutton", { name: `${name}, as a number` });
const isFocused = (locator) => locator.evaluate((node) => node === document.activeElement);

async function waitForValue(locator, value) {
  const node = await locator.elementHandle();
  await locator.page().waitForFunction(([node, value]) => node.value === value, [node, value]);
}

async function waitForSceneText(text) {
  const deadline = Date.now() + TIMEOUT;
  while (!studio.read("scene.toml").includes(text)) {
    assert.ok(Date.now() < deadline, `no ${text} in ${studio.read("scene.toml")}`);
    await new Promise((resolve) => setTimeout(resolve, 10));
  }
}

async function choose(page, name) {
  await page.fill("#object-find", name);
  await page.keyboard.press("Enter");
  await page.locator("#object-name", { hasText: name }).waitFor();
}

// Records the changes that a page requests. The returned function returns the changes since its last call.
async function recordChanges(page) {
  await page.evaluate(() => {
    const send = WebSocket.prototype.send;
    window.sent = [];
    WebSocket.prototype.send = function (text) {
      const message = JSON.parse(text);
      if (["set", "look", "slide", "view", "frame", "reset_camera"].some((name) => message === name || message[name] !== undefined)) window.sent.push(text);
      return send.call(this, text);
    };
  });
  return () => page.evaluate(() => window.sent.splice(0));
}

test("a half-typed number stays while other controls come and go", async () => {
  const [page, otherPage] = [await open(browser, studio), await open(browser, studio)];
  await choose(page, "shapes[0]");
  await choose(otherPage, "shapes[0]");
  const zBox = box(page, "shapes[0].center", 2);
  await zBox.focus();
  await page.keyboard.press("Control+a");
  await page.keyboard.type("0.7");
  await box(otherPage, "shapes[0].material").selectOption("grey");
  await box(page, "materials.grey.color").waitFor();
  assert.equal(await page.locator('[data-name="materials.red"]').count(), 0);
  assert.equal(await zBox.inputValue(), "0.7");
  assert.ok(await isFocused(zBox));
  assert.ok(studio.read("scene.toml").includes("center = [0, 0, 0.5]"), "a half-typed number was written");
  await page.keyboard.type("5");
  await page.keyboard.press("Enter");
  await waitForSceneText("center = [0, 0, 0.75]");
  // A removed box discards its text; the keys that follow have no effect.
  const sent = await recordChanges(page);
  await box(page, "materials.grey.shininess", 1).focus();
  await page.keyboard.press("Control+a");
  await page.keyboard.type("3");
  await box(otherPage, "shapes[0].material").selectOption("red");
  await page.locator('[data-name="materials.grey"]').waitFor({ state: "detached" });
  await page.keyboard.type("5r");
  assert.deepEqual(await sent(), []);
  assert.equal(studio.read("scene.toml").match(/shininess = 16/g).length, 2);
  // A field that moves from the defaults to the values of the file keeps the focus; the list of defaults stays open.
  await choose(page, "render");
  const defaults = page.locator('[data-name="render"] .absent');
  await defaults.locator("> summary").click();
  const seedInFile = page.locator('[data-name="render"] > div [data-control="render.seed 1"]');
  await box(page, "render.seed", 1).focus();
  await page.keyboard.type("2");
  await page.keyboard.press("Enter");
  await seedInFile.waitFor();
  assert.ok(await isFocused(seedInFile));
  assert.ok(await defaults.evaluate((node) => node.open));
  // If a key removes the value, the field moves back to the defaults and keeps the focus.
  await page.locator('[data-path="render.seed"]').getByRole("button", { name: "default" }).focus();
  await page.keyboard.press("Enter");
  await seedInFile.waitFor({ state: "detached" });
  assert.ok(await isFocused(box(page, "render.seed")));
  assert.deepEqual(page.errors, []);
});

test("a half-typed value of a shader override stays while sliders are added and removed, and sliders have the ranges in the file", async () => {
  const page = await open(browser, studio);
  const sent = await recordChanges(page);
  const level = number(page, "level");
  await level.focus();
  await page.keyboard.press("Control+a");
  await page.keyboard.type("0.2");
  appendToKernel(`override early: f32 = 0.5; // 0..1\n${LEVEL}override wide: f32 = 5.0; // 0..1000\n`);
  await slider(page, "wide").waitFor();
  assert.equal(await level.inputValue(), "0.2");
  await page.keyboard.type("5");
  assert.deepEqual(await sent(), []);
  await page.keyboard.press("Enter");
  await waitForValue(slider(page, "level"), "0.25");
  await waitUntilSettled(page);
  assert.deepEqual((await sent()).map((text) => JSON.parse(text).slide.value), [0.25]);
  // The arrow keys change the value in steps, as in any other box.
  await page.keyboard.press("ArrowUp");
  await waitForValue(slider(page, "level"), "0.26");
  await page.keyboard.press("Control+a");
  await page.keyboard.press("Delete");
  await slider(page, "level").focus();
  await waitForValue(level, "0.26");
  const wide = slider(page, "wide");
  assert.equal(await wide.getAttribute("step"), "1");
  appendToKernel(`override wide: f32 = 0.05; // 0..0.1\n${LEVEL}`);
  await waitForValue(wide, "0.05");
  assert.deepEqual(await wide.evaluate((node) => [node.min, node.max, Number(node.step)]), ["0", "0.1", 0.0001]);
  appendToKernel(`override wide: f32 = 0.05; // 0..0.2\n${LEVEL}`);
  await page.locator("#sliders input[max='0.2']").waitFor();
  assert.equal(await slider(page, "early").count(), 0);
  // A removed slider discards its half-typed number.
  await sent();
  await number(page, "wide").focus();
  await page.keyboard.press("Control+a");
  await page.keyboard.type("0.0");
  appendToKernel(LEVEL);
  await wide.waitFor({ state: "detached" });
  await page.keyboard.type("5");
  assert.deepEqual(await sent(), []);
  assert.deepEqual(page.errors, []);
});

test("touch scrolling changes no values; dragging and tapping do", async () => {
  const page = await open(browser, studio, PHONE);
  const client = await page.context().newCDPSession(page);
  await choose(page, "shapes[0]");
  await page.evaluate(() => document.activeElement.blur());
  const sent = await recordChanges(page);
  // After a swipe, the page keeps scrolling for a few animation frames.
  const waitForScrollEnd = () => page.evaluate(async () => {
    let last = null;
    for (let unchangedFrames = 0; unchangedFrames < 4; unchangedFrames = last === scrollY ? unchangedFrames + 1 : 0) {
      last = scrollY;
      await new Promise((resolve) => requestAnimationFrame(resolve));
    }
  });
  const swipe = async (control, dx, dy) => {
    await control.evaluate((node) => scrollBy(0, node.getBoundingClientRect().top - 680));
    await waitForScrollEnd();
    const area = await control.boundingBox();
    const [x, y] = [area.x + area.width * 0.15, area.y + area.height / 2];
    const touch = (type, touchPoints) => client.send("Input.dispatchTouchEvent", { type, touchPoints });
    const oldScrollY = await page.evaluate(() => scrollY);
    await touch("touchStart", [{ x, y }]);
    for (let i = 1; i <= 12; i++) await touch("touchMove", [{ x: x + (dx * i) / 12, y: y + (dy * i) / 12 }]);
    await touch("touchEnd", []);
    await waitForScrollEnd();
    return (await page.evaluate(() => scrollY)) - oldScrollY;
  };
  const sliders = [box(page, "shapes[0].radius"), slider(page, "level"), page.locator("#exposure")];
  const boxes = [box(page, "shapes[0].radius", 1), number(page, "level"), page.locator("#exposure-number")];
  for (const control of [...sliders, ...boxes]) {
    const value = await control.inputValue();
    assert.ok((await swipe(control, 5, -96)) > 20, "a vertical swipe does not scroll");
    assert.equal(await control.inputValue(), value);
    assert.deepEqual(await sent(), []);
    assert.ok(Math.abs(await swipe(control, 60, 3)) < 10, "a horizontal drag scrolls");
    assert.ok((await sent()).length > 0);
    await waitUntilSettled(page);
    await sent();
    if (boxes.includes(control)) continue;
    await swipe(control, 0, 0);
    assert.equal((await sent()).length, 1);
    await waitUntilSettled(page);
  }
  // After these gestures, boxes still follow the file, and another object can be selected.
  const radius = box(page, "shapes[0].radius", 1);
  await swipe(radius, 5, -96);
  studio.write("scene.toml", SCENE.replace("radius = 0.5", "radius = 0.35"));
  await waitForValue(radius, "0.35");
  await swipe(radius, 5, -96);
  const area = await canvas(page).boundingBox();
  await page.touchscreen.tap(area.x + area.width * 0.9, area.y + area.height * 0.6);
  await box(page, "shapes[1].point").waitFor({ state: "attached" });
  assert.deepEqual(page.errors, []);
});

test("keys act on the control that has the focus", async () => {
  const page = await open(browser, studio);
  await choose(page, "shapes[0]");
  const sent = await recordChanges(page);
  for (const [control, min] of [[page.locator("#exposure"), -10], [slider(page, "level"), 0]]) {
    await control.focus();
    await page.keyboard.press("Home");
    const [change] = await sent();
    const { look, slide } = JSON.parse(change);
    assert.equal(look?.exposure ?? slide.value, min);
  }
  await box(page, "shapes[0].radius").focus();
  await page.keyboard.press("Home"); // the range of the slider then follows the value
  await page.waitForFunction(() => Number(document.querySelector('[data-control="shapes[0].radius 1"]').value) < 0.01);
  await page.locator("#object-find").focus();
  for (const key of ["Home", "r", "5", " "]) await page.keyboard.press(key);
  // The keys of the camera act only while the image has the focus.
  for (const control of ["#transform", "#help summary", "#copy", "#exposure-number"]) {
    await page.locator(control).focus();
    for (const key of ["Home", "f", "r"]) await page.keyboard.press(key);
  }
  await page.locator("#exposure").focus();
  await page.keyboard.press("r");
  await waitUntilSettled(page);
  const kinds = (await sent()).map((text) => (typeof JSON.parse(text) === "string" ? text : Object.keys(JSON.parse(text))[0]));
  assert.deepEqual(kinds, ["set"]);
  await canvas(page).focus();
  await page.keyboard.press("Home");
  await page.locator("#help summary").focus();
  await page.keyboard.press("2");
  assert.deepEqual(await sent(), ['{"frame":null}', '{"view":"normal"}']);
});

test("on a narrow or zoomed-in screen, the focus is never behind the image", async () => {
  for (const options of [PHONE, { viewport: { width: 600, height: 400 } }]) {
    const page = await open(browser, studio, options);
    await choose(page, "shapes[0]");
    const focusStops = [];
    const pressRepeatedly = async (key) => {
      for (let i = 0; i < 60; i++) {
        await page.keyboard.press(key);
        const focusStop = await page.evaluate(() => {
          const { activeElement: node } = document;
          const [{ top, bottom }, stage] = [node.getBoundingClientRect(), document.getElementById("stage").getBoundingClientRect()];
          if (!node.closest("aside")) return null;
          const name = node.id || node.dataset.control || node.name || node.textContent.slice(0, 20);
          const isTall = bottom - top > innerHeight - stage.bottom;
          const isSeen = isTall ? bottom > stage.bottom && top < innerHeight : top > stage.bottom - 1 && bottom < innerHeight + 1;
          return { name, isSeen, edges: [top, bottom, stage.bottom] };
        });
        if (focusStop) focusStops.push(focusStop);
      }
    };
    await page.evaluate(() => document.querySelector("#help summary").focus());
    await pressRepeatedly("Shift+Tab");
    await page.locator("#pause").focus();
    await pressRepeatedly("Tab");
    assert.ok(focusStops.length > 60, `${focusStops.length} focus stops`);
    assert.deepEqual(focusStops.filter(({ isSeen }) => !isSeen), []);
  }
});

test("an error disappears when its invalid value is replaced, and an input left empty shows the last value again", async () => {
  const page = await open(browser, studio);
  await choose(page, "shapes[0]");
  const radius = box(page, "shapes[0].radius", 1);
  await radius.fill("-1");
  await page.keyboard.press("Enter");
  const error = page.locator('[data-path="shapes[0].radius"] .bad');
  await error.filter({ hasText: "must be from 1e-9 to 1e9" }).waitFor();
  studio.edit("scene.toml", "# a small scene", "# another");
  await waitForValue(radius, "0.5");
  await error.waitFor({ state: "hidden" });
  for (const control of [radius, page.locator("#exposure-number")]) {
    const value = await control.inputValue();
    await control.focus();
    await page.keyboard.press("Control+a");
    await page.keyboard.press("Delete");
    await page.keyboard.press("Tab");
    assert.equal(await control.inputValue(), value);
  }
  const link = (file) => page.evaluate((file) => import("/editor.js").then(({ editorLink }) => editorLink("x://file/{file}:{line}", { file, line: 3 })), file);
  assert.equal(await link("/a/$$/$'.wgsl"), "x://file/a/$$/$'.wgsl:3");
});

test("a viewer beyond the limit gets a message, and connects when a slot becomes free", async () => {
  const page = await open(browser, studio);
  await page.evaluate(async () => {
    window.otherViewers = Array.from({ length: 15 }, () => new WebSocket(`ws://${location.host}/socket`));
    await Promise.all(window.otherViewers.map((socket) => new Promise((resolve) => (socket.onopen = resolve))));
  });
  const latePage = await visit(browser, studio);
  await latePage.locator("#badge", { hasText: "Viewer limit reached" }).waitFor();
  await page.evaluate(() => window.otherViewers[0].close());
  await latePage.locator("#badge.live").waitFor({ state: "attached" });
});

test("the progress is visible with forced colors", async () => {
  const page = await open(browser, studio, { forcedColors: "active" });
  const bar = page.locator("#bar");
  const countColors = async () => {
    const [, , bytes] = await decode(page, [...await bar.screenshot()]);
    return new Set(bytes.match(/\d+,\d+,\d+/g)).size;
  };
  await page.evaluate(() => (document.getElementById("bar").value = 0.5));
  assert.ok((await countColors()) >= 3, "fewer than three colors: edge, finished part, remaining part");
});

test("the sample count of a grid steps from one square number to the next", async () => {
  const page = await open(browser, studio);
  await choose(page, "render");
  const waitForCount = (number) => waitForSceneText(`count = ${number} }\nlight`);
  const [range, field] = [0, 1].map((nth) => box(page, "render.pixel_samples.count", nth));
  await range.focus();
  await page.keyboard.press("ArrowRight");
  await waitForCount(9);
  await waitForValue(field, "9");
  await field.focus();
  await page.keyboard.press("ArrowUp");
  await waitForCount(16);
  await page.keyboard.press("ArrowDown");
  await page.keyboard.press("ArrowDown");
  await waitForCount(4);
  // A drag around one position does not alternate between two square numbers.
  const sent = await recordChanges(page);
  await page.locator("#pause").focus();
  await field.scrollIntoViewIfNeeded();
  const { x, y, width, height } = await field.boundingBox();
  await page.mouse.move(x + width / 2, y + height / 2);
  await page.mouse.down();
  for (const dx of [20, 21, 22, 21, 22, 20]) await page.mouse.move(x + width / 2 + dx, y + height / 2);
  await page.mouse.up();
  await waitForCount(9);
  await waitUntilSettled(page);
  assert.deepEqual((await sent()).map((text) => JSON.parse(text).set.value), [9]);
  await field.focus();
  await page.keyboard.press("PageUp");
  await waitForCount(169); // ten square numbers higher
  // A typed count is sent unchanged; its error stays until a valid count is typed.
  const error = page.locator('[data-path="render.pixel_samples.count"] [role=alert]', { hasText: "square" });
  await field.fill("5");
  await page.keyboard.press("Enter");
  await error.waitFor();
  await page.locator("#notice.bad", { hasText: "square" }).waitFor();
  await field.fill("9");
  await page.keyboard.press("Enter");
  await error.waitFor({ state: "hidden" });
  await page.locator("#notice").waitFor({ state: "hidden" });
  await waitForCount(9);
  await page.locator("#max-samples").fill("1.5");
  await page.keyboard.press("Enter");
  await page.locator("#notice.bad", { hasText: "must be a whole number from 1 to 65,536, not 1.5" }).waitFor();
  assert.equal(await page.locator("#max-samples").inputValue(), "");
  // Other patterns accept any count.
  await box(page, "render.pixel_samples.pattern").selectOption("sobol");
  await waitForSceneText('pattern = "sobol", count = 9');
  await page.locator('[data-control="render.pixel_samples.count 0"][max="1000"]').waitFor();
  await field.focus();
  await page.keyboard.press("ArrowUp");
  await waitForCount(10);
  assert.deepEqual(page.errors, []);
});

test("the focus of a control that is disabled or removed moves to a nearby element and returns with the control", async () => {
  const page = await open(browser, studio);
  const isParentFocused = (id) => page.evaluate((id) => document.activeElement === document.getElementById(id).parentElement, id);
  await choose(page, "shapes[0]");
  await box(page, "shapes[0].radius", 1).fill("0.4");
  await page.keyboard.press("Enter");
  await waitForSceneText("radius = 0.4");
  await page.locator("#undo-write:enabled").focus();
  await page.keyboard.press("Enter");
  await page.locator("#undo-write:disabled").waitFor();
  assert.ok(await isParentFocused("undo-write"));
  await page.keyboard.press("Tab");
  assert.ok(await isFocused(page.locator("#redo-write")), "the focus did not move to the neighboring button");
  // A control with the focus may also be hidden: the button beside a field, or the canvas of a comparison.
  await slider(page, "level").focus();
  await page.keyboard.press("ArrowRight");
  await page.getByRole("button", { name: "Reset level" }).focus();
  await page.keyboard.press("Enter");
  assert.ok(await isFocused(slider(page, "level")));
  await page.locator("#pause").focus();
  await page.keyboard.press("7");
  await page.locator("[data-part=second] canvas").waitFor();
  await page.locator("[data-part=second] canvas").focus();
  await page.keyboard.press("1");
  await page.locator("[data-part=second] canvas").waitFor({ state: "hidden" });
  assert.ok(await isFocused(canvas(page)));
  // The button that deletes a view has the focus and disappears with the view.
  await page.keyboard.press("b");
  await page.getByRole("button", { name: "Delete view 1" }).focus();
  await page.keyboard.press("Enter");
  assert.ok(await isFocused(page.locator("#bookmarks")));
  // Without a connection, all controls are disabled. After a reconnection, the same control has the focus, unless the
  // user has moved the focus.
  for (const [keys, expected] of [[[], "#pause"], [["Tab"], "#save-png"]]) {
    await page.locator("#pause").focus();
    await studio.stop();
    await page.locator("#badge.lost").waitFor();
    assert.ok(await isParentFocused("pause"));
    for (const key of keys) await page.keyboard.press(key);
    await studio.start(studio.port);
    await page.locator("#badge.live").waitFor({ state: "attached" });
    assert.ok(await isFocused(page.locator(expected)), expected);
  }
  // Focusing the button scrolls only the panel.
  await page.evaluate(() => document.querySelectorAll("aside details").forEach((details) => (details.open = true)));
  await page.locator("#reference-file").focus();
  assert.equal(await page.evaluate(() => scrollY), 0);
  const button = await page.locator("label[for=reference-file]").boundingBox();
  assert.ok(button.y >= 0 && button.y + button.height <= 800, `${button.y}`);
  // After a click outside of all controls, no control regains the focus.
  await page.locator("#restart").focus();
  await page.locator("h1").click();
  await studio.stop();
  await page.locator("#badge.lost").waitFor();
  assert.ok(await isFocused(page.locator("body")));
});
