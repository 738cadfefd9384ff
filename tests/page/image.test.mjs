// The image of the page: frames are acknowledged, the wipe can be dragged, invalid pixels are located, and the camera
// always responds.

import assert from "node:assert/strict";
import { after, afterEach, before, beforeEach, test } from "node:test";

import { Studio, canvas, launch, open, recordMessages, revision, shownImage, waitForImage, waitUntilSettled } from "./studio.mjs";

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

const camera = (page) => page.locator("#camera-text").innerText();

test("every frame on the screen is acknowledged by its number", async () => {
  const page = await open(browser, studio);
  const sent = await recordMessages(page, (message) => message.shown !== undefined);
  const oldRevision = await revision(page);
  await canvas(page).focus();
  await page.keyboard.press("ArrowLeft");
  await waitForImage(page, oldRevision);
  await waitUntilSettled(page);
  await page.waitForTimeout(100); // a few more refreshes of the screen
  const numbers = (await sent()).map(({ shown }) => shown);
  assert.ok(numbers.length > 0);
  assert.deepEqual(numbers, [...numbers].sort((a, b) => a - b));
  // A response that follows an acknowledgement is still matched to its request.
  await canvas(page).hover();
  await page.locator("#values", { hasText: "linear RGB" }).waitFor();
  await page.keyboard.press("ArrowRight");
  await waitUntilSettled(page);
  assert.deepEqual(page.errors, []);
});

test("the divider of a wipe is dragged in the image", async () => {
  const page = await open(browser, studio);
  await page.keyboard.press("7");
  await page.locator("[data-part=second] canvas").waitFor();
  await page.getByLabel("Wipe").check();
  await waitUntilSettled(page);
  const oldCamera = await camera(page);
  const area = await canvas(page, "first").boundingBox();
  const [x, y] = [area.x + area.width / 2, area.y + area.height * 0.3];
  await page.mouse.move(x + 1, y);
  assert.equal(await canvas(page, "first").evaluate((canvas) => getComputedStyle(canvas).cursor), "ew-resize");
  await page.mouse.down();
  await page.mouse.move(area.x + area.width * 0.6, y, { steps: 4 });
  await page.mouse.move(area.x + area.width * 0.25, y + 30, { steps: 4 });
  await page.mouse.up();
  await waitUntilSettled(page);
  assert.ok(Math.abs(Number(await page.locator("#wipe").inputValue()) - 0.25) < 0.01, await page.locator("#wipe").inputValue());
  assert.equal(await camera(page), oldCamera, "dragging the divider moved the camera");
  // A drag beside the divider orbits.
  await page.mouse.move(x, y);
  assert.notEqual(await canvas(page, "first").evaluate((canvas) => getComputedStyle(canvas).cursor), "ew-resize");
  await page.mouse.down();
  await page.mouse.move(x + 40, y, { steps: 4 });
  await page.mouse.up();
  await page.locator("#moved").waitFor();
  // The keyboard moves the divider, too.
  await page.locator("#wipe").focus();
  await page.keyboard.press("Home");
  assert.equal(await page.locator("#wipe").inputValue(), "0");
  assert.deepEqual(page.errors, []);
});

const editKernel = (lines) => studio.edit("shaders/kernels/render.wgsl", "film[index] = sum;", `let zero = f32(params.samples.x) * 0.0;\n${lines}\nfilm[index] = sum;`);

test("a badge on the image counts invalid pixels, and a click on the badge opens the section of counts", async () => {
  const page = await open(browser, studio);
  const validImage = await shownImage(page);
  const badge = page.locator("#invalid");
  assert.ok(await badge.isHidden());
  editKernel("if pixel.y == 3u && pixel.x == 0u { sum.x = zero / zero; }");
  await badge.filter({ hasText: /^1 NaN pixel$/ }).waitFor();
  const [area, panels] = [await badge.boundingBox(), await page.locator("#panels").boundingBox()];
  assert.ok(area.x >= panels.x && area.x + area.width <= panels.x + panels.width && area.y >= panels.y, "the badge is outside of the image");
  // A ring marks a single pixel.
  await waitUntilSettled(page);
  const pixelAt = (image, x, y) => image[2].split(",").slice(3 * (y * 120 + x), 3 * (y * 120 + x) + 3).join();
  assert.notEqual(pixelAt(await shownImage(page), 8, 3), pixelAt(validImage, 8, 3));
  await page.setViewportSize({ width: 1200, height: 420 });
  await page.locator("#display > summary").click();
  await badge.click();
  await page.waitForFunction(() => {
    const { top, bottom } = document.getElementById("fault-counts").getBoundingClientRect();
    return document.getElementById("display").open && top >= 0 && bottom <= innerHeight;
  });
  assert.ok(await page.locator("#faults").evaluate((node) => node === document.activeElement));
  assert.deepEqual(page.errors, []);
});

test("an image full of invalid pixels has colored pixels, but no rings", async () => {
  const page = await open(browser, studio);
  editKernel("sum.x = zero / zero;");
  await page.locator("#invalid", { hasText: /^10,800 NaN pixels$/ }).waitFor();
  await waitUntilSettled(page);
  assert.deepEqual([...new Set((await shownImage(page))[2].match(/\d+,\d+,\d+/g))], ["255,0,255"]);
});

test("screen readers get the keys of the viewport while the section of keys is closed", async () => {
  const page = await open(browser, studio);
  assert.equal(await page.locator("#help").evaluate((help) => help.open), false);
  const client = await page.context().newCDPSession(page);
  const { nodes } = await client.send("Accessibility.getFullAXTree");
  const viewport = nodes.find(({ name, ignored }) => !ignored && name?.value?.startsWith("Viewport: colour"));
  assert.match(viewport.description?.value ?? "", /Arrow keys orbit/);
});

test("a dolly passes the look-at point, and its distance is limited", async () => {
  const page = await open(browser, studio);
  await canvas(page).focus();
  const point = (text, key) => new RegExp(`${key} = \\[(.*)\\]`).exec(text)[1].split(",").map(Number);
  const distance = (text) => Math.hypot(...point(text, "position").map((v, i) => v - point(text, "look_at")[i]));
  const dolly = async (key, count) => {
    for (let i = 0; i < count; i++) await page.keyboard.press(key);
    await waitUntilSettled(page);
    return camera(page);
  };
  const start = await camera(page);
  const near = await dolly("PageUp", 60);
  const nearer = await dolly("PageUp", 10);
  const movedDistance = Math.hypot(...point(nearer, "position").map((v, i) => v - point(near, "position")[i]));
  assert.ok(movedDistance > 0.02, `10 steps move the camera by ${movedDistance}`);
  await page.keyboard.press("r");
  await page.locator("#reset:disabled").waitFor();
  const far = await dolly("PageDown", 100);
  assert.ok(distance(far) < 1001 * distance(start), far);
  assert.ok(distance(far) > 100 * distance(start), far);
  assert.deepEqual(page.errors, []);
});

test("on a phone, the toolbar scrolls to the selected view", async () => {
  const page = await open(browser, studio, { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true });
  const isInView = (selector) => page.waitForFunction((selector) => {
    const { left, right } = document.querySelector(selector).getBoundingClientRect();
    return left >= 0 && right <= innerWidth;
  }, selector);
  await canvas(page).focus();
  await page.keyboard.press("7");
  await isInView("label:has([value=compare])");
  await page.keyboard.press("1");
  await isInView("label:has([value=color])");
  await page.selectOption("#layers", "shading_normal");
  await isInView("#layers");
});
