// Writes crates/scene/src/gltf/meshopt/streams.txt: streams encoded by npm's meshoptimizer, with the results of its
// decoder.
//
//     npm install meshoptimizer@1.3.0
//     node tests/gltf/meshopt.mjs > crates/scene/src/gltf/meshopt/streams.txt
//
// With a number N as argument, the script prints N random streams instead, for tests that do not store the streams.
//
// Each line contains the name, mode, filter, stride and count, the stream in base64, and the decoded bytes. Bytes of
// filtered streams are in base64, because decoders may round them differently. Other bytes are stored as their 64-bit
// FNV-1a hash.

import { createRequire } from "node:module";
import path from "node:path";

const { MeshoptDecoder, MeshoptEncoder } = createRequire(path.join(process.cwd(), "/"))("meshoptimizer");
await Promise.all([MeshoptDecoder.ready, MeshoptEncoder.ready]);

let state = 1;
// Returns an integer below `count`, by a linear congruential generator.
function random(count) {
	state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
	return Math.floor((state / 2 ** 32) * count);
}
const uniform = () => random(2 ** 30) / 2 ** 30;

function hash(bytes) {
	let value = 0xcbf29ce484222325n;
	for (const byte of bytes) value = BigInt.asUintN(64, (value ^ BigInt(byte)) * 0x100000001b3n);
	return value.toString(16).padStart(16, "0");
}

const base64 = (bytes) => Buffer.from(bytes).toString("base64");

function printLine(name, mode, filter, stride, count, stream) {
	const decoded = new Uint8Array(count * stride);
	MeshoptDecoder.decodeGltfBuffer(decoded, count, stride, stream, mode, filter);
	const expected = filter === "NONE" ? hash(decoded) : base64(decoded);
	console.log([name, mode, filter, stride, count, base64(stream), expected].join(" "));
}

// Generators of test data. Each returns the bytes of `count` elements of `stride` bytes.
const KINDS = {
	zeros: (count, stride) => new Uint8Array(count * stride),
	random: (count, stride) => Uint8Array.from({ length: count * stride }, () => random(256)),
	// Bytes that change little from element to element, except for a few large changes.
	smooth: (count, stride) => {
		const current = Uint8Array.from({ length: stride }, () => random(256));
		return Uint8Array.from({ length: count * stride }, (_, i) => {
			const k = i % stride;
			current[k] += random(20) === 0 ? random(256) : random(1 << (k % 5));
			return current[k];
		});
	},
	shorts: (count, stride) => {
		const values = new Uint16Array((count * stride) / 2);
		for (let i = 0; i < values.length; i++) {
			const k = i % (stride / 2);
			values[i] = (i < stride / 2 ? random(65536) : values[i - stride / 2]) + random(40 << (k % 4)) - 15;
		}
		return new Uint8Array(values.buffer);
	},
	floats: (count, stride) => {
		const values = new Float32Array((count * stride) / 4);
		for (let i = 0; i < values.length; i++) {
			const k = i % (stride / 4);
			values[i] = Math.fround(Math.sin((i - k) * 0.001 * (k + 1)) * 10 ** (k % 3));
		}
		return new Uint8Array(values.buffer);
	},
	// Floats whose lowest 14 bits are zero.
	rounded: (count, stride) => {
		const bytes = KINDS.floats(count, stride);
		const words = new Uint32Array(bytes.buffer);
		for (let i = 0; i < words.length; i++) words[i] &= 0xffff0000 | (i % 3 << 14);
		return bytes;
	},
};

function printAttributes(kind, stride, count, level, version) {
	const bytes = KINDS[kind](count, stride);
	const stream = MeshoptEncoder.encodeVertexBufferLevel(bytes, count, stride, level, version);
	printLine(`${kind}-${stride}-${count}-${level}-v${version}`, "ATTRIBUTES", "NONE", stride, count, stream);
}

// Returns the indices of the triangles of a grid, row by row, with `strays` random triangles between them.
function grid(side, strays) {
	const indices = [];
	for (let y = 0; y < side; y++) {
		for (let x = 0; x < side; x++) {
			const corner = y * (side + 1) + x;
			indices.push(corner, corner + 1, corner + side + 1, corner + side + 1, corner + 1, corner + side + 2);
		}
	}
	const vertexCount = (side + 1) ** 2;
	for (let i = 0; i < strays; i++) {
		const offset = random(indices.length / 3 + 1) * 3;
		indices.splice(offset, 0, random(vertexCount), random(vertexCount), random(vertexCount));
	}
	return Uint32Array.from(indices);
}

function printIndices(name, values, mode, stride) {
	const typed = stride === 2 ? Uint16Array.from(values) : Uint32Array.from(values);
	const bytes = new Uint8Array(typed.buffer);
	const encode = mode === "TRIANGLES" ? MeshoptEncoder.encodeIndexBuffer : MeshoptEncoder.encodeIndexSequence;
	printLine(name, mode, "NONE", stride, typed.length, encode(bytes, typed.length, stride));
}

// Returns random unit vectors, of which every fifth is parallel to an axis. If `dimensions` is 3, a fourth component of
// 1 or -1 follows.
function units(count, dimensions) {
	const values = [];
	for (let i = 0; i < count; i++) {
		let v = Array.from({ length: dimensions }, () => uniform() * 2 - 1);
		if (i % 5 === 0) v = v.map((_, k) => (k === (i / 5) % dimensions ? (i % 2 ? -1 : 1) : 0));
		const length = Math.hypot(...v);
		values.push(...v.map((x) => x / length));
		if (dimensions === 3) values.push(i % 2 ? -1 : 1);
	}
	return Float32Array.from(values);
}

function printFilteredAttributes(filter, stride, bits, version, count = 24) {
	let elements;
	if (filter === "OCTAHEDRAL") elements = MeshoptEncoder.encodeFilterOct(units(count, 3), count, stride, bits);
	if (filter === "QUATERNION") elements = MeshoptEncoder.encodeFilterQuat(units(count, 4), count, stride, bits);
	if (filter === "EXPONENTIAL") {
		const values = Float32Array.from({ length: (count * stride) / 4 }, () => (uniform() - 0.5) * 10 ** (random(20) - 10));
		elements = MeshoptEncoder.encodeFilterExp(values, count, stride, bits);
	}
	if (filter === "COLOR") {
		const values = Float32Array.from({ length: count * 4 }, (_, i) => (i < 16 ? (i >> 1) & 1 : uniform()));
		elements = MeshoptEncoder.encodeFilterColor(values, count, stride, bits);
	}
	const stream = MeshoptEncoder.encodeVertexBufferLevel(elements, count, stride, 2, version);
	printLine(`${filter.toLowerCase()}-${stride}-${bits}-v${version}`, "ATTRIBUTES", filter, stride, count, stream);
}

const streamCount = Number(process.argv[2] ?? 0);
if (streamCount === 0) {
	for (const [kind, stride, count] of [
		["zeros", 4, 1],
		["zeros", 256, 600],
		["random", 4, 33],
		["random", 12, 15],
		["smooth", 4, 16],
		["smooth", 8, 17],
		["smooth", 16, 257],
		["smooth", 256, 33],
		["shorts", 4, 300],
		["shorts", 12, 100],
		["floats", 12, 100],
		["rounded", 16, 70],
	]) {
		printAttributes(kind, stride, count, 0, 0);
		for (const level of [0, 3]) printAttributes(kind, stride, count, level, 1);
	}
	printAttributes("random", 16, 300, 0, 1);
	for (const stride of [2, 4]) {
		printIndices(`grid-${stride}`, grid(8, 0), "TRIANGLES", stride);
		printIndices(`strays-${stride}`, grid(8, 60), "TRIANGLES", stride);
		printIndices(`twice-${stride}`, [...grid(4, 0), ...grid(4, 3)], "TRIANGLES", stride);
		printIndices(`rows-${stride}`, grid(6, 0), "INDICES", stride);
		const strip = Array.from({ length: 60 }, (_, i) => (i % 2 ? i : 1000 + i * 3));
		printIndices(`strip-${stride}`, [...strip, 65534, 0, 65000], "INDICES", stride);
	}
	printIndices("large", [4294967294, 0, 7, 3000000000, 2147483648, 4294967294], "TRIANGLES", 4);
	for (const version of [0, 1]) {
		for (const bits of [2, 5, 8]) printFilteredAttributes("OCTAHEDRAL", 4, bits, version);
		for (const bits of [9, 12, 16]) printFilteredAttributes("OCTAHEDRAL", 8, bits, version);
		for (const bits of [4, 11, 16]) printFilteredAttributes("QUATERNION", 8, bits, version);
		for (const bits of [1, 12, 24]) printFilteredAttributes("EXPONENTIAL", 12, bits, version);
		for (const bits of [2, 7, 8]) printFilteredAttributes("COLOR", 4, bits, version);
		for (const bits of [9, 12, 16]) printFilteredAttributes("COLOR", 8, bits, version);
	}
}
for (let i = 0; i < streamCount; i++) {
	const version = random(2);
	const pick = (list) => list[random(list.length)];
	switch (random(4)) {
		case 0:
		case 1: {
			const stride = 4 * (1 + random(random(2) ? 64 : 8));
			printAttributes(pick(Object.keys(KINDS)), stride, 1 + random(700), version * random(4), version);
			break;
		}
		case 2: {
			const [mode, stride] = [pick(["TRIANGLES", "INDICES"]), pick([2, 4])];
			printIndices("indices", grid(1 + random(30), random(2) * random(200)), mode, stride);
			break;
		}
		default: {
			const filter = pick(["OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"]);
			const stride = filter === "QUATERNION" ? 8 : filter === "EXPONENTIAL" ? 4 * (1 + random(8)) : pick([4, 8]);
			const minBits = { OCTAHEDRAL: 2, QUATERNION: 4, EXPONENTIAL: 1, COLOR: 2 }[filter];
			const maxBits = filter === "EXPONENTIAL" ? 24 : filter === "QUATERNION" ? 16 : stride * 2;
			printFilteredAttributes(filter, stride, minBits + random(maxBits - minBits + 1), version, 1 + random(300));
		}
	}
}
