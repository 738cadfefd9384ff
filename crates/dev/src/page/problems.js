// The list of errors below the image.

import { editorLink } from "/editor.js";
import { element } from "/link.js";
import { make } from "/parts.js";

const capitalized = (text) => text[0].toUpperCase() + text.slice(1);
let shown = "";

// Shows the errors. `hasImage` is true if an image from before the error is on the screen.
export function showProblems({ problems, editor, reading }, hasImage) {
  const count = problems.length === 1 ? "1 problem" : `${problems.length} problems`;
  element("problems").querySelector("summary").textContent = reading ? `${count}. Reading the changed files…` : count;
  // An unchanged list is not rebuilt, so that selected text stays selected.
  const content = JSON.stringify([problems, editor, hasImage]);
  if (content === shown) return;
  shown = content;
  const dock = element("problems");
  dock.hidden = !problems.length;
  element("problem-list").replaceChildren(...problems.map((problem) => makeArticle(problem, editor, hasImage)));
}

function makeArticle(problem, editor, hasImage) {
  const { kind, place, message, excerpt } = problem;
  const title = make("h2", { textContent: place ?? kind });
  const link = editorLink(editor, problem);
  if (link) title.replaceChildren(make("a", { textContent: place ?? kind, href: link, title: "Open in the editor" }));
  const article = make("article", {}, title, make("p", { textContent: message }));
  if (excerpt) article.append(make("pre", { textContent: excerpt }));
  const fallback = hasImage ? " Showing the last good image." : "";
  article.append(make("small", { textContent: `${capitalized(kind)} error.${fallback}` }));
  return article;
}

// Returns the badge for an error that leaves no image to show.
export const errorBadge = ({ problems: [first] }) => `${capitalized(first.kind)} error. No image yet`;
