// Conversion between linear colours and the sRGB bytes of a colour picker.

import { digits } from "/numbers.js";

const encode = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
const decode = (x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);

// Returns a linear colour as sRGB hex. A colour above 1 is divided by its largest channel first.
export function hexOf(color) {
  const scale = Math.max(1, ...color);
  const byte = (x) => Math.round(255 * encode(Math.min(1, Math.max(0, x / scale)))).toString(16).padStart(2, "0");
  return `#${color.map(byte).join("")}`;
}

// Returns the linear colour of an sRGB hex value. If the old colour is above 1, multiplies by its largest channel.
export function colorOf(hex, old) {
  const scale = Math.max(1, ...old);
  return [1, 3, 5].map((start) => digits(decode(parseInt(hex.slice(start, start + 2), 16) / 255) * scale, 4));
}
