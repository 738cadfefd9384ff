// Sliders under a finger: one that scrolls the page, and came down on a slider, does not move it.

const SLACK = 3; // pixels to the side before a touch is a drag

let press = null; // a finger on a slider: what it began with, and whether what the slider says is held back

export function setUpTouch() {
  const on = (type, act) => window.addEventListener(type, act, true);
  const ofPress = (act) => (event) => event.pointerId === press?.id && act(event);
  on("pointerdown", ({ target, pointerType, pointerId, isPrimary, clientX, clientY }) => {
    if (!isPrimary) return;
    const isSlider = pointerType !== "mouse" && target.matches("input[type=range]:enabled");
    press = isSlider ? { range: target, from: target.value, id: pointerId, left: clientX, top: clientY, waits: true } : null;
  });
  for (const type of ["input", "change"]) {
    on(type, (event) => event.target === press?.range && press.waits && event.stopImmediatePropagation());
  }
  on("pointermove", ofPress(({ clientX, clientY }) => {
    const [x, y] = [Math.abs(clientX - press.left), Math.abs(clientY - press.top)];
    if (press.waits && x > SLACK && x > y) tell();
  }));
  on("pointerup", ofPress(() => press.waits && tell()));
  // The browser took the finger to scroll.
  on("pointercancel", ofPress(() => {
    const { range, from, waits } = press;
    range.value = from;
    if (!waits) tell();
  }));
  // What comes of the touch comes at once.
  for (const type of ["touchend", "touchcancel"]) on(type, () => setTimeout(() => (press = null)));
}

// Tells the page what the slider says.
function tell() {
  press.waits = false;
  press.range.dispatchEvent(new Event("input", { bubbles: true }));
}
