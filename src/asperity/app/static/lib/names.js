// Names and symbols: those of the paper, or of geophysics, as the server's one table has them.

const KEY = "asperity-names";
let chosen = "friction";
let usual = {};

/** Take the names of geophysics from the catalogue, and what was chosen on an earlier visit. */
export function useNames(catalogue) {
  usual = catalogue.geophysics;
  try {
    chosen = localStorage.getItem(KEY) === "geophysics" ? "geophysics" : "friction";
  } catch {
    // Storage may be switched off.
  }
}

/** "friction" or "geophysics". */
export const names = () => chosen;

export function setNames(set) {
  chosen = set === "geophysics" ? "geophysics" : "friction";
  try {
    localStorage.setItem(KEY, chosen);
  } catch {
    // As above.
  }
}

/** Formula of a parameter of the catalogue. */
export const symbolOf = (parameter) => (chosen === "geophysics" && parameter.geophysics) || parameter.symbol;

/** Name of a parameter as plain text. */
export const nameOf = (name) => (chosen === "geophysics" && usual[name]) || name;

const LABELS = [
  [/W\/W₀/g, "σ/σ̄"], [/F\/W₀?/g, "τ/σ"], [/W₀/g, "σ̄"], [/\bA − B\b/g, "a − b"], [/\bage\b/g, "θ"],
];

/** A label of the page in the chosen names. */
export function worded(label) {
  if (chosen === "friction" || typeof label !== "string") return label;
  return LABELS.reduce((text, [from, to]) => text.replace(from, to), label);
}
