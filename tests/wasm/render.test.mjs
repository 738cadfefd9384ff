// Renders 8 x 8 pixels from bytes in Node, on the CPU backend compiled to WebAssembly. `scripts/test-wasm` runs this
// file.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

const readFile = (name) => readFileSync(new URL(name, import.meta.url));
const module = new WebAssembly.Module(readFileSync(process.env.WGRAY_WASM));

// The module imports only the clock (of the crate web-time, through wasm-bindgen) and helpers of wasm-bindgen. On web pages, `wasm-bindgen` generates these
// imports. Integer handles represent JavaScript objects. Handles from 128 to `statics_end` are never dropped; here, all
// of these handles represent `performance`.
const intrinsics = [
    [/_now_/, () => performance.now()],
    [/static_accessor|performance/, () => 1024],
    [/is_undefined/, () => 0],
    [/statics_end$/, () => 2048],
    [/describe|_ref$|table_|spawn_poll|throw/, () => assert.fail("an unexpected import was called")],
];
const imports = {};
for (const { module: source, name } of WebAssembly.Module.imports(module)) {
    assert.match(source, /^__wbindgen_/, `an import that wasm-bindgen does not define: ${source}.${name}`);
    const [, implementation] = intrinsics.find(([pattern]) => pattern.test(name));
    imports[source] ??= {};
    imports[source][name] = implementation;
}

// Instantiates the module and writes the text of a scene to its memory.
function instantiate(text) {
    const { exports } = new WebAssembly.Instance(module, imports);
    const bytes = new TextEncoder().encode(text);
    const address = exports.allocate(bytes.length);
    new Uint8Array(exports.memory.buffer, address, bytes.length).set(bytes);
    return { exports, scene: [address, bytes.length] };
}

function bytesAt({ memory }, result) {
    const [count] = new Uint32Array(memory.buffer, result, 1);
    return Buffer.from(memory.buffer.slice(result + 4, result + 4 + 4 * count));
}

function render(text) {
    const { exports, scene } = instantiate(text);
    return bytesAt(exports, exports.render(...scene));
}

// Renders with `Session::render_async`. Returns the pixels and the number of times that other tasks could run.
async function renderAsync(text) {
    const { exports, scene } = instantiate(text);
    exports.start_render(...scene);
    for (let pauses = 0; ; pauses++) {
        const result = exports.poll_render();
        if (result !== 0) {
            return { pixels: bytesAt(exports, result), pauses };
        }
        await new Promise((resolve) => setTimeout(resolve));
    }
}

test("a scene from bytes renders the recorded pixels", () => {
    const pixels = render(readFile("scene.toml").toString());
    assert.equal(pixels.length, 8 * 8 * 3 * 4);
    assert.ok(pixels.equals(readFile("pixels.f32")));
});

test("another seed renders other pixels", () => {
    const text = readFile("scene.toml").toString().replace("pixel_samples = 4", "pixel_samples = 4\nseed = 1");
    assert.ok(!render(text).equals(readFile("pixels.f32")));
});

test("an asynchronous render yields to other tasks and has the same pixels", async () => {
    const text = readFile("scene.toml")
        .toString()
        .replace("width = 8, height = 8", "width = 32, height = 32")
        .replace("pixel_samples = 4", "pixel_samples = 16");
    const { pixels, pauses } = await renderAsync(text);
    assert.ok(pauses > 2, `${pauses} pauses`);
    assert.ok(pixels.equals(render(text)));
});

test("without the feature formats, its files are rejected", () => {
    const { exports } = new WebAssembly.Instance(module, imports);
    const errors = bytesAt(exports, exports.errors_without_formats()).toString().trimEnd().split("\n");
    const rule = (name) => `${name} files need the cargo feature "formats"`;
    const texture = (name) => `scene.toml:19: textures.grid.file: "textures/a.image" cannot be decoded: ${rule(name)}`;
    assert.deepEqual(errors, [
        rule("OpenEXR"),
        rule("WebP"),
        `a.exr: ${rule("OpenEXR")}`,
        ...["EXR", "WebP", "KTX2"].map(texture),
    ]);
});
