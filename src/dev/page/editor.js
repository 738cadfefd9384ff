// Links that open a line of a file in an editor.

// Returns the link to a location {file, line, column} by the template that the program was given, or null if either is missing.
export function editorLink(template, { file, line, column }) {
  if (!template || !file) return null;
  const path = encodeURI(file.replaceAll("\\", "/")).replace(/[?#&=+;]/g, encodeURIComponent);
  // Replacements are functions because `$&` in a string would be expanded.
  return template
    .replace("/{file}", () => (path.startsWith("/") ? path : `/${path}`)) // the path may bring its own slash
    .replaceAll("{file}", () => path)
    .replaceAll("{line}", line ?? 1)
    .replaceAll("{column}", column ?? 1);
}
