// Linear light, and what a browser chooses a colour by: bytes of sRGB.

import { digits } from "/numbers.js";

const encode = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
const decode = (x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);

// What a display shows of linear light that is divided by its largest component, where that is above 1.
export function hexOf(color) {
  const most = Math.max(1, ...color);
  const byte = (x) => Math.round(255 * encode(Math.min(1, Math.max(0, x / most)))).toString(16).padStart(2, "0");
  return `#${color.map(byte).join("")}`;
}

// The light that looks like that, as strong as another.
export function colorOf(hex, like) {
  const most = Math.max(1, ...like);
  return [1, 3, 5].map((at) => digits(decode(parseInt(hex.slice(at, at + 2), 16) / 255) * most, 4));
}
