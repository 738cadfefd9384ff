// Where the focus goes when what has it is switched off, hidden or taken away: to what is around that, and back once it can be.

const AROUND = ".row, fieldset, ul, #object-groups, #sliders, #panels, details, section, aside";

let wanted = null; // what the user gave the focus
let around = []; // what that is in, from the innermost
let home = null; // what has the focus in its place

const isThere = (node) => node.isConnected && !node.matches(":disabled") && node.checkVisibility();

export function setUpFocus() {
  document.addEventListener("focusin", ({ target }) => {
    if (target === home) return;
    [wanted, around, home] = [target, [], null];
    for (let node = target.parentElement; node; node = node.parentElement) if (node.matches(AROUND)) around.push(node);
  });
  // Who leaves what is still there wants the focus nowhere.
  document.addEventListener("focusout", ({ target }) => setTimeout(() => {
    if (document.activeElement === document.body && isThere(target)) [wanted, home] = [null, null];
  }));
  const watched = { subtree: true, childList: true, attributes: true, attributeFilter: ["disabled", "hidden", "open"] };
  new MutationObserver(keepFocus).observe(document.body, watched);
}

function keepFocus() {
  const now = document.activeElement;
  if (!wanted || (now !== document.body && now !== (home ?? wanted))) return;
  if (isThere(wanted)) {
    if (!home) return;
    home = null;
    wanted.focus({ preventScroll: true });
  } else if (!home || !isThere(home)) {
    home = around.find(isThere) ?? null;
    if (!home) return;
    home.tabIndex = -1;
    home.focus({ preventScroll: true });
  }
}
