export const byId = id => document.getElementById(id);

// A new element with text and attributes.
export function element(tag, text = '', attributes = {}) {
  const made = document.createElement(tag);
  if (text) made.textContent = text;
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
}

// Writes text only where it changed: screen readers read what is written.
export function write(node, text) {
  if (node.textContent !== text) node.textContent = text;
}
