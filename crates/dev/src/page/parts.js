// Adds and removes parts of the page without disturbing focus or input in other parts.

import { forget } from "/numbers.js";

export const make = (tag, values = {}, ...children) => {
  const made = Object.assign(document.createElement(tag), values);
  made.append(...children);
  return made;
};

// Enables or disables a single control. `setOff` in page.js disables all controls while the connection is lost.
export function enable(control, isEnabled) {
  control.disabled = !isEnabled;
  delete control.dataset.off;
}

// Returns a map from key to part for a list of items; known parts are reused, missing parts are created.
export function keep(known, items, keyOf, makeOne) {
  return new Map(items.map((item) => {
    const key = keyOf(item);
    return [key, known.get(key) ?? makeOne(item)];
  }));
}

// Sets the children of parents, each given as [parent, children]. Children that stay are not touched; unfinished input
// in removed children is discarded.
export function place(...lists) {
  const focus = document.activeElement;
  const all = new Set(lists.flatMap(([, children]) => children));
  for (const gone of lists.flatMap(([parent]) => [...parent.children]).filter((child) => !all.has(child))) {
    forget(gone);
    gone.remove();
  }
  for (const [parent, children] of lists) {
    const own = new Set(children);
    let next = parent.firstElementChild;
    for (const child of children) {
      while (next && !own.has(next)) next = next.nextElementSibling; // moves to another parent
      if (child === next) next = next.nextElementSibling;
      else move(parent, child, next);
    }
  }
  if (focus.isConnected && focus !== document.activeElement) focus.focus({ preventScroll: true });
}

function move(parent, child, before) {
  if (parent.moveBefore && parent.isConnected && child.isConnected) {
    parent.moveBefore(child, before); // keeps the focus and half-typed text
    return;
  }
  forget(child);
  parent.insertBefore(child, before);
}
