// Writes the files of tests/textures/ktx2: KTX 2 files of the Basis Universal encoder (npm's ktx2-encoder), and for
// each file a PNG with the texels decoded by the Basis Universal transcoder (npm's three).
//
//     npm install ktx2-encoder@0.6.0 three@0.187.0
//     node tests/textures/ktx2.mjs tests/textures/ktx2

import fs from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";
import zlib from "node:zlib";
import { pathToFileURL } from "node:url";

const folder = process.argv[2];
const modules = path.join(process.cwd(), "node_modules");
const { encodeToKTX2 } = await import(pathToFileURL(path.join(modules, "ktx2-encoder/dist/node/index.js")));
const libraries = path.join(modules, "three/examples/jsm/libs/basis");
// The transcoder is not imported, because it is a CommonJS script in a folder of ES modules.
const script = fs.readFileSync(path.join(libraries, "basis_transcoder.js"), "utf8");
const start = new Function("require", "__filename", "__dirname", `${script}; return BASIS;`);
const transcoder = await start(createRequire(import.meta.url), libraries, libraries)({
	wasmBinary: fs.readFileSync(path.join(libraries, "basis_transcoder.wasm")),
});
transcoder.initializeBasis();

function png(width, height, rgba) {
	const chunk = (kind, data) => {
		const body = Buffer.concat([Buffer.from(kind), data]);
		const [length, sum] = [Buffer.alloc(4), Buffer.alloc(4)];
		length.writeUInt32BE(data.length);
		sum.writeUInt32BE(zlib.crc32(body));
		return Buffer.concat([length, body, sum]);
	};
	const head = Buffer.alloc(13);
	head.writeUInt32BE(width, 0);
	head.writeUInt32BE(height, 4);
	head.set([8, 6], 8);
	const rows = Buffer.alloc(height * (width * 4 + 1));
	for (let y = 0; y < height; y++) rows.set(rgba.subarray(y * width * 4, (y + 1) * width * 4), y * (width * 4 + 1) + 1);
	const chunks = [chunk("IHDR", head), chunk("IDAT", zlib.deflateSync(rows, { level: 9 })), chunk("IEND", Buffer.alloc(0))];
	return Buffer.concat([Buffer.from("\x89PNG\r\n\x1a\n", "latin1"), ...chunks]);
}

// Returns an image of smooth colors with some noise, so that all features of the encodings are used; alpha increases
// to the right.
function picture(width, height, hasAlpha) {
	let state = 1;
	const noise = () => ((state = (Math.imul(state, 1664525) + 1013904223) >>> 0) / 2 ** 32) * 40;
	const data = new Uint8Array(width * height * 4);
	for (let i = 0; i < width * height; i++) {
		const [x, y] = [i % width, Math.floor(i / width)];
		const color = [100 + 80 * Math.sin(x / 3), 100 + 80 * Math.cos(y / 4), 10 * (x ^ y)].map((c) => c + noise());
		data.set([...color, hasAlpha ? (255 * (x + 1)) / (width + 1) : 255], 4 * i);
	}
	return { width, height, data };
}

// Returns an image of four quarters, each of one color; the encodings store a block of one of these colors without loss.
function quarters() {
	const colors = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255]];
	const data = new Uint8Array(16 * 16 * 4);
	for (let i = 0; i < 256; i++) data.set([...colors[2 * (i >> 7) + ((i >> 3) & 1)], 255], 4 * i);
	return { width: 16, height: 16, data };
}

const etc1s = { isUASTC: false, qualityLevel: 200 };
const uastc = { isUASTC: true, uastcLDRQualityLevel: 2, needSupercompression: false };
const zstandard = { ...uastc, needSupercompression: true, enableRDO: true };
const srgb = { isPerceptual: true, isSetKTX2SRGBTransferFunc: true };
const linear = { isPerceptual: false, isSetKTX2SRGBTransferFunc: false };
for (const [name, image, options] of [
	["etc1s-1x1", picture(1, 1, false), { ...etc1s, ...srgb }],
	["uastc-1x1", picture(1, 1, true), { ...uastc, ...linear }],
	["zstandard-1x1", picture(1, 1, false), { ...zstandard, ...srgb }],
	["etc1s-5x7-alpha-levels", picture(5, 7, true), { ...etc1s, ...linear, generateMipmap: true }],
	["uastc-5x7-levels", picture(5, 7, false), { ...uastc, ...srgb, generateMipmap: true }],
	["zstandard-5x7-alpha-levels", picture(5, 7, true), { ...zstandard, ...linear, generateMipmap: true }],
	["etc1s-48x20", picture(48, 20, false), { ...etc1s, ...srgb }],
	["etc1s-48x20-alpha", picture(48, 20, true), { ...etc1s, ...srgb }],
	["uastc-48x20-alpha", picture(48, 20, true), { ...uastc, ...srgb }],
	["zstandard-48x20", picture(48, 20, false), { ...zstandard, ...linear }],
	["etc1s-quarters", quarters(), { ...etc1s, ...srgb }],
	["zstandard-quarters", quarters(), { ...zstandard, ...srgb, enableRDO: false }],
]) {
	const imageDecoder = async () => image;
	const bytes = await encodeToKTX2(new Uint8Array(1), { generateMipmap: false, ...options, imageDecoder });
	const file = new transcoder.KTX2File(new Uint8Array(bytes));
	if (!file.isValid() || !file.startTranscoding()) throw new Error(name);
	const rgba = new Uint8Array(file.getImageTranscodedSizeInBytes(0, 0, 0, 13));
	if (!file.transcodeImage(rgba, 0, 0, 0, 13, 0, -1, -1)) throw new Error(name);
	fs.writeFileSync(path.join(folder, `${name}.ktx2`), bytes);
	fs.writeFileSync(path.join(folder, `${name}.png`), png(image.width, image.height, rgba));
}
