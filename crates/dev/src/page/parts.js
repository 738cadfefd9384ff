// Adds and removes parts of the page without disturbing focus or input in other parts.

import { forget } from "/numbers.js";

export const make = (tag, values = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), values);
  element.append(...children);
  return element;
};

// Enables or disables a single control. `setOff` in page.js disables all controls while the connection is lost.
export function enable(control, isEnabled) {
  control.disabled = !isEnabled;
  delete control.dataset.off;
}

// Returns a map from key to part for a list of items. Reuses the old parts, and creates missing parts.
export function reuse(old, items, keyOf, create) {
  return new Map(items.map((item) => {
    const key = keyOf(item);
    return [key, old.get(key) ?? create(item)];
  }));
}

// Sets the children of several parents; each list is [parent, children]. Children that stay are not touched. Unfinished
// input in removed children is discarded.
export function setChildren(...lists) {
  const focused = document.activeElement;
  const remaining = new Set(lists.flatMap(([, children]) => children));
  for (const removed of lists.flatMap(([parent]) => [...parent.children]).filter((child) => !remaining.has(child))) {
    forget(removed);
    removed.remove();
  }
  for (const [parent, children] of lists) {
    const ownChildren = new Set(children);
    let next = parent.firstElementChild;
    for (const child of children) {
      while (next && !ownChildren.has(next)) next = next.nextElementSibling; // moves to another parent
      if (child === next) next = next.nextElementSibling;
      else move(parent, child, next);
    }
  }
  if (focused.isConnected && focused !== document.activeElement) focused.focus({ preventScroll: true });
}

function move(parent, child, before) {
  if (parent.moveBefore && parent.isConnected && child.isConnected) {
    parent.moveBefore(child, before); // keeps the focus and unfinished input
    return;
  }
  forget(child);
  parent.insertBefore(child, before);
}
