// Elements, without a framework.

/**
 * An element with attributes and children.
 * A function is an event handler, `false`, null and undefined leave an attribute out.
 */
export function el(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") node.addEventListener(name, value);
    else if (value === true) node.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) {
      node.setAttribute(name, value);
    }
  }
  node.append(...children.flat().filter((c) => c !== null && c !== undefined && c !== false));
  return node;
}

/** An element of SVG. */
export function shape(tag, attributes = {}, ...children) {
  const node = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  node.append(...children);
  return node;
}

/** Formulas of the server, which writes them itself. */
export function formula(markup) {
  const holder = document.createElement("span");
  holder.className = "formula";
  holder.innerHTML = markup;
  return holder;
}

/** Replace the children of a node. */
export function fill(node, ...children) {
  node.replaceChildren(...children.flat().filter(Boolean));
  return node;
}

let numbered = 0;

/** An id that is not taken. */
export function fresh(prefix) {
  numbered += 1;
  return `${prefix}-${numbered}`;
}
