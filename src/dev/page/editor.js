// Links that open a line of a file in an editor.

// The address of a place, {file, line, column}, in the form that the program was given; null where there is none.
export function editorLink(form, { file, line, column }) {
  if (!form || !file) return null;
  const path = encodeURI(file.replaceAll("\\", "/")).replace(/[?#&=+;]/g, encodeURIComponent);
  // Given by functions: in a text `$&` would mean something.
  return form
    .replace("/{file}", () => (path.startsWith("/") ? path : `/${path}`)) // the path has its own slash
    .replaceAll("{file}", () => path)
    .replaceAll("{line}", line ?? 1)
    .replaceAll("{column}", column ?? 1);
}
