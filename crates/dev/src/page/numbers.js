// Number boxes that accept typing, horizontal drags and key steps.

const DRAG_THRESHOLD = 3; // movement in pixels after which a press becomes a drag
const PIXELS_PER_STEP = 10; // drag distance in pixels per step
const FINE_FACTOR = 0.1; // step multiplier while Shift is held
const PIXELS_PER_LINE = 20; // pixels per line, for wheel events with deltaMode DOM_DELTA_LINE
const KEYS = { ArrowUp: 1, ArrowDown: -1, PageUp: 10, PageDown: -10 };
const HINT = "Drag sideways or press ↑/↓. Shift: 0.1×. Page Up/Down: 10×.";

let typing = null; // the box with an unfinished input, if any

export const digits = (x, count) => Number(x.toPrecision(count));
export const format = (x) => (x === undefined || x === null ? "" : String(x));

// Returns the valid value of a field that is nearest to `x`. Invalid values (inside `gap`, or not square if `squares`
// is set) are skipped in the direction of the change from the `old` value.
export function fit({ kind, range, gap, squares }, x, old) {
  let value = kind === "whole" ? Math.round(x) : digits(x, 12);
  if (squares) value = (x < old ? Math.floor : Math.ceil)(Math.sqrt(Math.max(value, 0))) ** 2;
  if (gap && value > gap[0] && value < gap[1]) value = x < old ? gap[0] : gap[1];
  if (range) value = Math.min(Math.max(value, range[0]), range[1]);
  return value;
}

// Returns the square number that is `steps` squares away from `x`.
const square = (x, steps) => Math.max((steps > 0 ? Math.floor : Math.ceil)(Math.sqrt(Math.max(x, 0))) + steps, 0) ** 2;

// Returns the step size of a number. The step depends on the largest magnitude in the list of the number.
function stepOf({ kind, unit, range }, list) {
  if (kind === "whole") return 1;
  const largest = Math.max(0, ...list.map((x) => Math.abs(x ?? 0)));
  if (largest > 0) return 10 ** (Math.floor(Math.log10(largest)) - 1);
  if (unit === "°") return 1;
  return range && range[1] - range[0] <= 2 ? 0.01 : 0.1;
}

// Lets the user edit a field's number in a box. `numbers()` returns the list that contains the number. `onValue(x)` is
// called with a new value on Enter or when the box loses the focus, unless the text is empty or not a number. Returns a
// function that shows a value unless the user is typing.
export function numberField(box, field, numbers, onValue) {
  let last;
  const setValue = (x) => {
    last = x;
    onValue(x);
  };
  box.classList.add("number");
  box.addEventListener("input", () => (typing = box));
  box.addEventListener("change", () => {
    if (typing !== box) return;
    typing = null;
    if (box.value !== "") setValue(box.valueAsNumber);
  });
  box.addEventListener("blur", () => {
    forget(box);
    if (box.value === "") box.value = format(last);
  });
  addSteps(box, field, numbers, setValue);
  return (x) => {
    last = x;
    if (typing !== box && box.value !== format(x)) box.value = format(x);
  };
}

// Discards unfinished input inside an element.
export function forget(element) {
  if (typing && element.contains(typing)) typing = null;
}

// By default, the wheel changes the value of a focused number box. This handler makes the wheel scroll instead.
export function setUpWheel() {
  document.addEventListener("wheel", (event) => {
    const box = event.target;
    if (box !== document.activeElement || !box.matches("input[type=number]")) return;
    event.preventDefault();
    if (event.ctrlKey) return; // a zoom gesture
    const unit = event.deltaMode === WheelEvent.DOM_DELTA_PIXEL ? 1 : PIXELS_PER_LINE;
    const panel = box.closest("aside");
    const scroller = panel && panel.scrollHeight > panel.clientHeight ? panel : document.scrollingElement;
    scroller.scrollBy(event.deltaX * unit, event.deltaY * unit);
  }, { passive: false });
}

// Makes a box respond to drags and step keys. See `numberField` for `numbers()` and `onValue(x)`.
function addSteps(box, field, numbers, onValue) {
  let press = null; // the state of the pointer press in progress
  let step = 0; // step size while a key is held: constant although the number's magnitude changes
  const current = () => (Number.isFinite(box.valueAsNumber) ? box.valueAsNumber : 0);
  const show = (x, old) => {
    const next = fit(field, x, old);
    if (box.value !== "" && next === current()) return;
    forget(box);
    box.value = format(next);
    onValue(next);
  };
  box.title = HINT;
  box.addEventListener("keydown", (event) => {
    const steps = KEYS[event.key];
    if (!steps || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    if (!event.repeat || !step) step = stepOf(field, [...numbers(), current()]);
    const factor = event.shiftKey && field.kind !== "whole" ? FINE_FACTOR : 1;
    show(field.squares ? square(current(), steps) : current() + steps * factor * step, current());
  });
  box.addEventListener("pointerdown", (event) => {
    // In a focused box, the pointer selects text.
    if (event.button !== 0 || box.disabled || document.activeElement === box) return;
    const stepPerPixel = stepOf(field, [...numbers(), current()]) / PIXELS_PER_STEP;
    box.setPointerCapture(event.pointerId); // a fast drag leaves the box immediately
    press = { id: event.pointerId, left: event.clientX, top: event.clientY, lastX: event.clientX, start: current(), moved: 0, stepPerPixel, dragged: false };
  });
  // Prevents a drag from selecting text. On touch screens, `mousedown` is fired after the release.
  box.addEventListener("mousedown", (event) => press && event.preventDefault());
  box.addEventListener("pointermove", (event) => {
    if (press?.id !== event.pointerId) return;
    if (!press.dragged) {
      const [x, y] = [Math.abs(event.clientX - press.left), Math.abs(event.clientY - press.top)];
      if (x < DRAG_THRESHOLD || (event.pointerType !== "mouse" && x < y)) return; // a finger may be about to scroll
      press.dragged = true;
      window.addEventListener("keydown", cancelByKey, true);
    }
    press.moved += (event.clientX - press.lastX) * press.stepPerPixel * (event.shiftKey ? FINE_FACTOR : 1);
    press.lastX = event.clientX;
    show(press.start + press.moved, press.start);
  });
  const end = () => {
    window.removeEventListener("keydown", cancelByKey, true);
    press = null;
  };
  const cancel = () => {
    const { start, dragged } = press;
    end();
    if (dragged) show(start, start);
  };
  const cancelByKey = (event) => {
    if (event.key !== "Escape" || !press) return;
    event.preventDefault();
    event.stopPropagation();
    cancel();
  };
  box.addEventListener("pointerup", () => {
    const isClick = press && !press.dragged;
    end();
    if (!isClick) return;
    box.focus();
    box.select();
  });
  box.addEventListener("pointercancel", () => press && cancel()); // the browser scrolls
}
