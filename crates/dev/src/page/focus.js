// If a focused control is disabled, hidden or removed, moves the focus to the control's container, and back when the
// control is available again.

const CONTAINERS = ".row, fieldset, ul, #object-groups, #sliders, #panels, details, section, aside";

let focused = null; // the element that the user focused
let containers = []; // the containers of this element, innermost first
let substitute = null; // the container that holds the focus while the control is unavailable

const isAvailable = (node) => node.isConnected && !node.matches(":disabled") && node.checkVisibility();

export function setUpFocus() {
  document.addEventListener("focusin", ({ target }) => {
    if (target === substitute) return;
    [focused, containers, substitute] = [target, [], null];
    for (let node = target.parentElement; node; node = node.parentElement) if (node.matches(CONTAINERS)) containers.push(node);
  });
  // If the user moves the focus away from an available control, the focus is not returned to this control.
  document.addEventListener("focusout", ({ target }) => setTimeout(() => {
    if (document.activeElement === document.body && isAvailable(target)) [focused, substitute] = [null, null];
  }));
  const watched = { subtree: true, childList: true, attributes: true, attributeFilter: ["disabled", "hidden", "open"] };
  new MutationObserver(keepFocus).observe(document.body, watched);
}

function keepFocus() {
  const active = document.activeElement;
  if (!focused || (active !== document.body && active !== (substitute ?? focused))) return;
  if (isAvailable(focused)) {
    if (!substitute) return;
    substitute = null;
    focused.focus({ preventScroll: true });
  } else if (!substitute || !isAvailable(substitute)) {
    substitute = containers.find(isAvailable) ?? null;
    if (!substitute) return;
    substitute.tabIndex = -1;
    substitute.focus({ preventScroll: true });
  }
}
