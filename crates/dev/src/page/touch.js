// Sliders on touch screens: a finger that scrolls the page does not move the slider under the finger.

const DRAG_THRESHOLD = 3; // sideways movement in pixels after which a touch becomes a drag

let press = null; // the touch on a slider: its initial value, and whether input events are held back

export function setUpTouch() {
  const on = (type, act) => window.addEventListener(type, act, true);
  const forPress = (act) => (event) => event.pointerId === press?.id && act(event);
  on("pointerdown", ({ target, pointerType, pointerId, isPrimary, clientX, clientY }) => {
    if (!isPrimary) return;
    const isSlider = pointerType !== "mouse" && target.matches("input[type=range]:enabled");
    press = isSlider ? { range: target, initial: target.value, id: pointerId, left: clientX, top: clientY, waits: true } : null;
  });
  for (const type of ["input", "change"]) {
    on(type, (event) => event.target === press?.range && press.waits && event.stopImmediatePropagation());
  }
  on("pointermove", forPress(({ clientX, clientY }) => {
    const [x, y] = [Math.abs(clientX - press.left), Math.abs(clientY - press.top)];
    if (press.waits && x > DRAG_THRESHOLD && x > y) release();
  }));
  on("pointerup", forPress(() => press.waits && release()));
  // The browser takes over the touch for scrolling.
  on("pointercancel", forPress(() => {
    const { range, initial, waits } = press;
    range.value = initial;
    if (!waits) release();
  }));
  // The browser fires input events for the touch right after this event.
  for (const type of ["touchend", "touchcancel"]) on(type, () => setTimeout(() => (press = null)));
}

// Dispatches the slider's value to the page.
function release() {
  press.waits = false;
  press.range.dispatchEvent(new Event("input", { bubbles: true }));
}
