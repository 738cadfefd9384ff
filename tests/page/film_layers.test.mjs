// Film layers on the page equal the layers of `wgray render --aov`. A layer that a scene lacks is disabled, and the
// page shows the reason.

import assert from "node:assert/strict";
import fs from "node:fs";
import { after, afterEach, before, beforeEach, test } from "node:test";

import { SCENE, Studio, assertSameImage, canvas, decode, launch, open, shownImage, waitUntilSettled } from "./studio.mjs";

const PATH_SCENE = SCENE.replace("[render]", "[render]\nintegrator = \"path\"\nbackground = [0.1, 0.2, 0.4]");

let browser;
let studio;

before(async () => (browser = await launch()));
after(() => browser.close());
beforeEach(() => (studio = new Studio()));
afterEach(async () => {
  await Promise.all(browser.contexts().map((context) => context.close()));
  await studio.remove();
});

async function selectView(page, view) {
  await page.selectOption("#layers", view);
  await page.waitForFunction((view) => document.getElementById("panels").dataset.view === view, view);
  await waitUntilSettled(page);
}

test("film layers are views with the images and files of a render", async () => {
  studio.write("scene.toml", PATH_SCENE);
  await studio.start();
  const page = await open(browser, studio);
  const colorImage = await shownImage(page);
  const compileTime = () => page.locator("#compile").innerText();
  const colorCompileTime = await compileTime();
  const names = ["direct", "indirect", "emission", "albedo"];
  studio.renderTo(studio.path("rendered.png"), ["--aov", names.join()]);
  const images = new Set([String(colorImage)]);
  for (const name of names) {
    await selectView(page, name);
    const image = await shownImage(page);
    assertSameImage(image, await decode(page, [...fs.readFileSync(studio.path(`rendered.${name}.png`))]), name);
    images.add(String(image));
    const saved = await page.evaluate(async () => [...new Uint8Array(await (await fetch("/picture.exr")).arrayBuffer())]);
    const header = Buffer.from(saved.slice(0, 1000)).toString("latin1");
    assert.match(header, new RegExp(`\\0chlist\\0....${name}\\.B\\0`, "s"), "the channel is missing in the EXR header");
  }
  assert.equal(images.size, 5, "two layers have the same image");
  assert.equal(await page.locator("#samples").innerText(), "4 of 4");
  await canvas(page).hover();
  await page.locator("#values", { hasText: /albedo [\d.]+ +[\d.]+ +[\d.]+.*bits.*shown/ }).waitFor();
  const layerCompileTime = await compileTime();
  assert.notEqual(layerCompileTime, colorCompileTime, "no kernel was compiled for the layers");
  await page.keyboard.press("1");
  await page.waitForFunction(() => document.getElementById("panels").dataset.view === "color");
  await waitUntilSettled(page);
  assertSameImage(await shownImage(page), colorImage);
  assert.equal(await compileTime(), layerCompileTime, "the kernel of the color view was compiled again");
  assert.deepEqual(page.errors, []);
});

test("a layer that the scene does not provide is disabled, and its tooltip gives the reason", async () => {
  await studio.start();
  const page = await open(browser, studio);
  const group = page.locator("#layers optgroup:has([value=direct])");
  const [direct, variance] = ["direct", "variance"].map((name) => page.locator(`#layers [value=${name}]`));
  assert.ok(await direct.isDisabled());
  assert.equal(await direct.getAttribute("title"), "needs integrator = \"path\"");
  assert.equal(await group.getAttribute("label"), "Light: needs integrator = \"path\"");
  assert.ok(await page.locator("#layers [value=shading_normal]").isEnabled());
  studio.write("scene.toml", PATH_SCENE.replace(
    "pixel_samples = { pattern = \"grid\", count = 4 }",
    "pixel_samples = { pattern = \"jittered\", count = 4 }\nadaptive = { error = 0.05, max_samples = 68 }",
  ));
  await page.waitForFunction(() => !document.querySelector("#layers [value=direct]").disabled);
  assert.ok(await variance.isEnabled());
  assert.equal(await group.getAttribute("label"), "Light");
  // A legend shows the false colors of the variance.
  await selectView(page, "variance");
  await page.locator("#legend", { hasText: "2⁻¹²" }).waitFor();
  await canvas(page).hover();
  await page.locator("#values", { hasText: /variance .*standard error/ }).waitFor();
  assert.equal(await page.locator("#layers").evaluate((select) => select.classList.contains("chosen")), true);
  assert.deepEqual(page.errors, []);
});
