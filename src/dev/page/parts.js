// Parts of the page that come and go while others stay, with what the user is doing in them.

import { forget } from "/numbers.js";

export const make = (tag, values = {}, ...children) => {
  const made = Object.assign(document.createElement(tag), values);
  made.append(...children);
  return made;
};

// What there is for each item, by its key: the old where there is one.
export function keep(known, items, keyOf, makeOne) {
  return new Map(items.map((item) => {
    const key = keyOf(item);
    return [key, known.get(key) ?? makeOne(item)];
  }));
}

// Gives parents the children that they are to have, each as [parent, children]. What stays is not touched; what is half typed in
// what goes is dropped.
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
      while (next && !own.has(next)) next = next.nextElementSibling; // it goes to another parent
      if (child === next) next = next.nextElementSibling;
      else move(parent, child, next);
    }
  }
  if (focus.isConnected && focus !== document.activeElement) focus.focus({ preventScroll: true });
}

function move(parent, child, before) {
  if (parent.moveBefore && parent.isConnected && child.isConnected) {
    parent.moveBefore(child, before); // the focus stays, and what is half typed
    return;
  }
  forget(child);
  parent.insertBefore(child, before);
}
