// Shader features of the page: sliders of overrides, kernel timings, editor links.

import assert from "node:assert/strict";
import { after, afterEach, before, beforeEach, test } from "node:test";

import { Studio, assertSameImage, launch, open, shownImage, waitUntilSettled } from "./studio.mjs";

const KERNEL = "shaders/kernels/render.wgsl";

let browser;
let studio;

before(async () => (browser = await launch()));
after(() => browser.close());
beforeEach(() => {
  studio = new Studio();
  studio.edit(KERNEL, "path_value(path)", "(path_value(path) * vec4f(level, select(0.0, level, green), level, 1.0))");
  studio.write(KERNEL, `${studio.read(KERNEL)}override level: f32 = 0.5; // 0..1\noverride green: bool = true;\n`);
});
afterEach(async () => {
  await Promise.all(browser.contexts().map((context) => context.close()));
  await studio.remove();
});

const readCompileTime = (page) => page.locator("#compile").innerText();

test("a slider changes the image without a compilation, and its declaration is copied", async () => {
  await studio.start();
  const page = await open(browser, studio);
  const [firstImage, compileTime] = [await shownImage(page), await readCompileTime(page)];
  const slider = page.getByRole("slider", { name: "level", exact: true });
  await slider.focus();
  for (let i = 0; i < 3; i++) await page.keyboard.press("PageUp");
  await waitUntilSettled(page);
  const field = page.getByRole("spinbutton", { name: "level, as a number" });
  assert.equal(await slider.inputValue(), await field.inputValue());
  assert.notEqual(await slider.inputValue(), "0.5");
  assert.notDeepEqual(await shownImage(page), firstImage);
  await field.fill("0.25");
  await field.press("Enter");
  await waitUntilSettled(page);
  assert.equal(await slider.inputValue(), "0.25");
  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  await page.click("#copy-sliders");
  await page.locator("#notice", { hasText: "Declarations copied" }).waitFor();
  assert.equal(await page.evaluate(() => navigator.clipboard.readText()), "override level: f32 = 0.25; // 0..1\n");
  // A Boolean override has a checkbox and can be reset.
  await page.getByRole("checkbox", { name: "green", exact: true }).uncheck();
  await waitUntilSettled(page);
  const green = (await shownImage(page))[2].split(",").filter((_, i) => i % 3 === 1);
  assert.ok(green.every((value) => value === "0"));
  await page.click("#reset-sliders");
  await waitUntilSettled(page);
  assertSameImage(await shownImage(page), firstImage);
  assert.equal(await readCompileTime(page), compileTime, "a kernel was compiled");
  await page.locator("#copy-sliders:disabled").waitFor();
  assert.deepEqual(page.errors, []);
});

test("timings of kernels and frame stages are shown", async () => {
  await studio.start();
  const page = await open(browser, studio);
  await page.locator("#times summary").click();
  const row = (name) => page.locator("#times tbody tr", { has: page.getByRole("rowheader", { name, exact: true }) });
  await row("render").first().waitFor();
  for (const stage of ["read files", "compile", "read back", "make PNG", "send"]) {
    await row(stage).waitFor();
    assert.match(await row(stage).innerText(), /[\d.]+ (s|ms|µs)/, stage);
  }
  assert.deepEqual(page.errors, []);
});

test("an error is shown with three lines of the shader and a link that opens the editor", async () => {
  await studio.start();
  const page = await open(browser, studio);
  studio.breakShader();
  const link = page.locator("#problem-list h2 a");
  await link.waitFor();
  const file = encodeURI(studio.path(KERNEL));
  const line = studio.errorLine();
  assert.ok((await link.getAttribute("href")).startsWith(`vscode://file${file}:${line}:`), await link.getAttribute("href"));
  const lineNumbers = (await page.locator("#problem-list pre").innerText()).match(/^ *\d+(?= \|)/gm).map(Number);
  assert.deepEqual(lineNumbers, [line - 1, line, line + 1]);
  const sliderLink = page.locator("#sliders a").first();
  assert.match(await sliderLink.getAttribute("href"), /^vscode:\/\/file\/.*render\.wgsl:\d+:1$/);
  // Without an editor, no links are shown.
  await studio.stop();
  studio.fixShader();
  await studio.start(0, ["--editor", "off"]);
  const pageWithoutEditor = await open(browser, studio);
  assert.equal(await pageWithoutEditor.locator("#sliders a").first().getAttribute("href"), null);
});
