// Shader features of the page: sliders of marked constants, layers, kernel timings, editor links.

import assert from "node:assert/strict";
import { after, afterEach, before, beforeEach, test } from "node:test";

import { Studio, canvas, launch, open, same, settled, shown } from "./studio.mjs";

const KERNEL = "shaders/kernels/render.wgsl";
const PLACE = "let place = vec2f(pixel) + at.xy;\n    var ray";

let browser;
let studio;

before(async () => (browser = await launch()));
after(() => browser.close());
beforeEach(() => {
  studio = new Studio();
  studio.edit(KERNEL, "path_value(path)", "(path_value(path) * vec4f(tint * level, 1.0))");
  studio.write(KERNEL, `${studio.read(KERNEL)}const level: f32 = 0.5; // slider 0..1\nconst tint: vec3f = vec3f(1.0, 1.0, 1.0); // color\n`);
});
afterEach(async () => {
  await Promise.all(browser.contexts().map((context) => context.close()));
  await studio.remove();
});

const compiled = (page) => page.locator("#compile").innerText();

test("a slider changes the image without the compiler, and is written to the shader", async () => {
  await studio.start();
  const page = await open(browser, studio);
  const [first, time] = [await shown(page), await compiled(page)];
  const slider = page.getByRole("slider", { name: "level", exact: true });
  await slider.focus();
  for (let i = 0; i < 3; i++) await page.keyboard.press("PageUp");
  await settled(page);
  const field = page.getByRole("spinbutton", { name: "level, as a number" });
  assert.equal(await slider.inputValue(), await field.inputValue());
  assert.notEqual(await slider.inputValue(), "0.5");
  assert.notDeepEqual(await shown(page), first);
  await field.fill("0.25");
  await field.press("Enter");
  await settled(page);
  assert.equal(await slider.inputValue(), "0.25");
  const quarter = await shown(page);
  // `wgray render` uses the built-in shaders, so the edited file is compared instead.
  const before = studio.read(KERNEL);
  await page.click("#write-sliders");
  await page.locator("#write-sliders:disabled").waitFor();
  assert.equal(studio.read(KERNEL), before.replace("f32 = 0.5", "f32 = 0.25"));
  await settled(page);
  same(await shown(page), quarter);
  await page.click("#undo-sliders");
  await page.waitForFunction(() => document.querySelector("#sliders input[type=range]").value === "0.5");
  await settled(page);
  same(await shown(page), first);
  assert.equal(await compiled(page), time, "nothing was compiled");
  // A chosen colour is shown, and can be reset.
  await page.getByRole("spinbutton", { name: "tint, green" }).fill("0");
  await page.keyboard.press("Enter");
  await settled(page);
  const green = (await shown(page))[2].split(",").filter((_, i) => i % 3 === 1);
  assert.ok(green.every((value) => value === "0"));
  await page.click("#reset-sliders");
  await settled(page);
  same(await shown(page), first);
  assert.deepEqual(page.faults, []);
});

test("a shader layer is a view with readable values", async () => {
  studio.edit("shaders/pixel.wgsl", PLACE, PLACE.replace("\n", "\n    seen = vec3f(0.25, 0.5, 1.0);\n"));
  studio.write("shaders/pixel.wgsl", `${studio.read("shaders/pixel.wgsl")}var<private> seen: vec3f; // layer\n`);
  await studio.start();
  const page = await open(browser, studio);
  await page.selectOption("#layers", "layer:seen");
  await page.waitForFunction(() => {
    const { view, done } = document.getElementById("panels").dataset;
    return view === "layer" && done === "true";
  });
  await settled(page);
  const [, , bytes] = await shown(page);
  assert.deepEqual([...new Set(bytes.match(/\d+,\d+,\d+/g))], ["64,128,255"]);
  await canvas(page).hover();
  await page.locator("#values", { hasText: "0.25 0.5 1" }).waitFor();
  assert.deepEqual(page.faults, []);
});

test("timings of kernels and frame stages are shown", async () => {
  await studio.start();
  const page = await open(browser, studio);
  await page.locator("#times summary").click();
  const row = (name) => page.locator("#times tbody tr", { has: page.getByRole("rowheader", { name, exact: true }) });
  await row("render").first().waitFor();
  for (const part of ["read files", "compile", "read back", "make PNG", "send"]) {
    await row(part).waitFor();
    assert.match(await row(part).innerText(), /[\d.]+ (s|ms|µs)/, part);
  }
  assert.deepEqual(page.faults, []);
});

test("an error shows three lines and a link that opens the editor", async () => {
  await studio.start();
  const page = await open(browser, studio);
  studio.breakShader();
  const link = page.locator("#problem-list h2 a");
  await link.waitFor();
  const file = encodeURI(studio.path(KERNEL));
  const line = studio.brokenLine();
  assert.ok((await link.getAttribute("href")).startsWith(`vscode://file${file}:${line}:`), await link.getAttribute("href"));
  const numbers = (await page.locator("#problem-list pre").innerText()).match(/^ *\d+(?= \|)/gm).map(Number);
  assert.deepEqual(numbers, [line - 1, line, line + 1]);
  const place = page.locator("#sliders a").first();
  assert.match(await place.getAttribute("href"), /^vscode:\/\/file\/.*render\.wgsl:\d+:1$/);
  // Without an editor no links are shown.
  await studio.stop();
  studio.mendShader();
  await studio.start(0, ["--editor", "off"]);
  const other = await open(browser, studio);
  assert.equal(await other.locator("#sliders a").first().getAttribute("href"), null);
});
