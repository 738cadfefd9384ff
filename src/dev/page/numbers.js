// Boxes of numbers that are typed into, dragged sideways or stepped by keys.

const SLACK = 3; // pixels before a press is a drag
const PIXELS = 10; // of a drag that are one step
const FINE = 0.1; // of a step, with Shift
const KEYS = { ArrowUp: 1, ArrowDown: -1, PageUp: 10, PageDown: -10 };
const HINT = "Drag sideways, or press the arrow keys: with Shift a tenth, by Page Up and Page Down ten steps";

let typing = null; // the box with a number that is half typed: there is never more than one

export const digits = (x, count) => Number(x.toPrecision(count));
export const say = (x) => (x === undefined || x === null ? "" : String(x));

// The nearest number that a field may have. Out of a gap, and from square to square, it goes on in the direction in which it came.
export function fit({ kind, range, gap, squares }, x, from) {
  let found = kind === "whole" ? Math.round(x) : digits(x, 12);
  if (squares) found = (x < from ? Math.floor : Math.ceil)(Math.sqrt(Math.max(found, 0))) ** 2;
  if (gap && found > gap[0] && found < gap[1]) found = x < from ? gap[0] : gap[1];
  if (range) found = Math.min(Math.max(found, range[0]), range[1]);
  return found;
}

// The square that is so many squares from a number.
const square = (x, steps) => Math.max((steps > 0 ? Math.floor : Math.ceil)(Math.sqrt(Math.max(x, 0))) + steps, 0) ** 2;

// How far a step of a number goes that stands with others in a list: they are of about one size.
function stepOf({ kind, unit, range, step }, list) {
  if (step) return step;
  if (kind === "whole") return 1;
  const most = Math.max(0, ...list.map((x) => Math.abs(x ?? 0)));
  if (most > 0) return 10 ** (Math.floor(Math.log10(most)) - 1);
  if (unit === "°") return 1;
  return range && range[1] - range[0] <= 2 ? 0.01 : 0.1;
}

// Makes a box one for a number of a field. `numbers()` are the list that it stands in, `use(x)` takes its new number: when it is
// left or Enter is pressed, unless it is empty or none. Returns what shows a number in it, unless one is half typed.
export function numberField(box, field, numbers, use) {
  let last;
  const take = (x) => {
    last = x;
    use(x);
  };
  box.classList.add("number");
  box.addEventListener("input", () => (typing = box));
  box.addEventListener("change", () => {
    if (typing !== box) return;
    typing = null;
    if (box.value !== "") take(box.valueAsNumber);
  });
  box.addEventListener("blur", () => {
    forget(box);
    if (box.value === "") box.value = say(last);
  });
  steppable(box, field, numbers, take);
  return (x) => {
    last = x;
    if (typing !== box && box.value !== say(x)) box.value = say(x);
  };
}

// What is half typed in a part of the page is not sent.
export function forget(part) {
  if (typing && part.contains(typing)) typing = null;
}

// Lets a box be dragged and stepped. `numbers()` are the list that it stands in, `use(x)` takes its new number.
function steppable(box, field, numbers, use) {
  let press = null; // what a press of the pointer began with
  let step = 0; // of a key that is held down: it stays while the number changes its size
  const now = () => (Number.isFinite(box.valueAsNumber) ? box.valueAsNumber : 0);
  const show = (x, from) => {
    const next = fit(field, x, from);
    if (box.value !== "" && next === now()) return;
    forget(box);
    box.value = say(next);
    use(next);
  };
  box.title = HINT;
  box.addEventListener("keydown", (event) => {
    const steps = KEYS[event.key];
    if (!steps || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    if (!event.repeat || !step) step = stepOf(field, [...numbers(), now()]);
    const way = event.shiftKey && field.kind !== "whole" ? FINE : 1;
    show(field.squares ? square(now(), steps) : now() + steps * way * step, now());
  });
  box.addEventListener("pointerdown", (event) => {
    // In a box that is typed into the pointer belongs to the text.
    if (event.button !== 0 || box.disabled || document.activeElement === box) return;
    const size = stepOf(field, [...numbers(), now()]) / PIXELS;
    box.setPointerCapture(event.pointerId); // a quick hand leaves the box at once
    press = { id: event.pointerId, left: event.clientX, top: event.clientY, at: event.clientX, from: now(), moved: 0, size, dragged: false };
  });
  // What may be a drag selects no text; a finger's press ends before this comes.
  box.addEventListener("mousedown", (event) => press && event.preventDefault());
  box.addEventListener("pointermove", (event) => {
    if (press?.id !== event.pointerId) return;
    if (!press.dragged) {
      const [x, y] = [Math.abs(event.clientX - press.left), Math.abs(event.clientY - press.top)];
      if (x < SLACK || (event.pointerType !== "mouse" && x < y)) return; // a finger may be about to scroll
      press.dragged = true;
      window.addEventListener("keydown", giveUp, true);
    }
    press.moved += (event.clientX - press.at) * press.size * (event.shiftKey ? FINE : 1);
    press.at = event.clientX;
    show(press.from + press.moved, press.from);
  });
  const end = () => {
    window.removeEventListener("keydown", giveUp, true);
    press = null;
  };
  const takeBack = () => {
    const { from, dragged } = press;
    end();
    if (dragged) show(from, from);
  };
  const giveUp = (event) => {
    if (event.key !== "Escape" || !press) return;
    event.preventDefault();
    event.stopPropagation();
    takeBack();
  };
  box.addEventListener("pointerup", () => {
    const isClick = press && !press.dragged;
    end();
    if (!isClick) return;
    box.focus();
    box.select();
  });
  box.addEventListener("pointercancel", () => press && takeBack()); // the finger scrolls
}
