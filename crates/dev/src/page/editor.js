// Links that open a line of a file in an editor.

// Returns the editor link to a location {file, line, column}, or null without a template (--editor off) or a file.
export function editorLink(template, { file, line, column }) {
  if (!template || !file) return null;
  const path = encodeURI(file.replaceAll("\\", "/")).replace(/[?#&=+;]/g, encodeURIComponent);
  // The replacements are functions, because patterns such as `$&` in a replacement string would be expanded.
  return template
    .replace("/{file}", () => (path.startsWith("/") ? path : `/${path}`)) // avoids a double slash before an absolute path
    .replaceAll("{file}", () => path)
    .replaceAll("{line}", line ?? 1)
    .replaceAll("{column}", column ?? 1);
}
