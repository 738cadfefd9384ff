// If a focused control is disabled, hidden or removed, moves the focus to its container, and back when the control is
// available again.

const AROUND = ".row, fieldset, ul, #object-groups, #sliders, #panels, details, section, aside";

let wanted = null; // the element that the user focused
let around = []; // its containers, innermost first
let home = null; // the container that holds the focus while the control is unavailable

const isAvailable = (node) => node.isConnected && !node.matches(":disabled") && node.checkVisibility();

export function setUpFocus() {
  document.addEventListener("focusin", ({ target }) => {
    if (target === home) return;
    [wanted, around, home] = [target, [], null];
    for (let node = target.parentElement; node; node = node.parentElement) if (node.matches(AROUND)) around.push(node);
  });
  // If the user moves the focus away from an available control, the focus is not returned to this control.
  document.addEventListener("focusout", ({ target }) => setTimeout(() => {
    if (document.activeElement === document.body && isAvailable(target)) [wanted, home] = [null, null];
  }));
  const watched = { subtree: true, childList: true, attributes: true, attributeFilter: ["disabled", "hidden", "open"] };
  new MutationObserver(keepFocus).observe(document.body, watched);
}

function keepFocus() {
  const now = document.activeElement;
  if (!wanted || (now !== document.body && now !== (home ?? wanted))) return;
  if (isAvailable(wanted)) {
    if (!home) return;
    home = null;
    wanted.focus({ preventScroll: true });
  } else if (!home || !isAvailable(home)) {
    home = around.find(isAvailable) ?? null;
    if (!home) return;
    home.tabIndex = -1;
    home.focus({ preventScroll: true });
  }
}
