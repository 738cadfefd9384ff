// Marks drawn over the image: frames around pixels, rings around invalid pixels, and the divider of a wipe.

const MAX_RINGS = 8; // maximum number of invalid pixels that get rings; more pixels are visible without rings
const HANDLE_RADIUS = 11; // radius of the divider's handle, in CSS pixels

// Draws a path in black, then with a thinner line in white, so that the path is visible on any image.
function outline(context, widths, path) {
  for (const [color, lineWidth] of [["#000", widths[0]], ["#fff", widths[1]]]) {
    Object.assign(context, { strokeStyle: color, lineWidth });
    context.beginPath();
    path();
    context.stroke();
  }
}

// Draws a frame around a pixel, at a distance in CSS pixels.
export function frame(context, pixel, scale, distance) {
  context.lineWidth = 1;
  for (const [color, inset] of [["#000", -distance], ["#fff", 1 - distance]]) {
    context.strokeStyle = color;
    const [x, y] = pixel.map((v) => v * scale + inset);
    context.strokeRect(x, y, scale - 2 * inset, scale - 2 * inset);
  }
}

// Draws rings around invalid pixels, so that isolated pixels are not overlooked.
export function rings(context, part, { width, height, sent, faults }, scale) {
  const invalid = faults.find(([name]) => name === part)?.[1];
  if (!invalid || invalid.nan + invalid.infinite + invalid.negative > MAX_RINGS) return;
  for (const [x, y] of invalid.places) {
    const center = [((x + 0.5) * width) / sent[0], ((y + 0.5) * height) / sent[1]].map((v) => v * scale);
    outline(context, [4, 2], () => context.arc(...center, 8, 0, 2 * Math.PI));
  }
}

// Draws the divider of a wipe from `top` to `bottom`, with a handle in the middle.
export function divider(context, x, top, bottom) {
  outline(context, [3, 1], () => {
    context.moveTo(x, top);
    context.lineTo(x, bottom);
  });
  const y = (top + bottom) / 2;
  context.fillStyle = "#000a";
  context.beginPath();
  context.arc(x, y, HANDLE_RADIUS, 0, 2 * Math.PI);
  context.fill();
  outline(context, [3, 1.5], () => {
    for (const side of [-1, 1]) {
      context.moveTo(x + 3 * side, y - 4);
      context.lineTo(x + 7 * side, y);
      context.lineTo(x + 3 * side, y + 4);
    }
  });
}
