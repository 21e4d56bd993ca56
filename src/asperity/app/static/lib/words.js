// Words of the page: names and symbols of the paper or of geophysics, as the server's table has them, and
// what sentences need.

const KEY = "asperity-names";
let chosen = "friction";
let usual = {};
let laws = {};

/** Take the names of geophysics from the catalogue, and what was chosen on an earlier visit. */
export function useNames(catalogue) {
  ({ geophysics: usual, laws } = catalogue);
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
  [/W\/W₀/g, "σ/σ̄"], [/F\/W₀/g, "τ/σ̄"], [/F\/W/g, "τ/σ"], [/W₀/g, "σ̄"], [/\bA − B\b/g, "a − b"], [/\bage\b/g, "θ"],
];

/** A label of the page in the chosen names. */
export function worded(label) {
  if (chosen === "friction" || typeof label !== "string") return label;
  return LABELS.reduce((text, [from, to]) => text.replace(from, to), label);
}

/** A sentence with a capital at its beginning, unless it begins with the name of a number, a law or, before a colon, a recording. */
export function capital(text) {
  const [first, second] = text.split(" ", 2);
  const isName = !/^[a-z]{2,},?$/.test(first) || second === "must" || first in laws;
  return isName ? text : text.charAt(0).toUpperCase() + text.slice(1);
}

/** A text of a terminal with the signs of print: ± − µ. */
export function typeset(text) {
  if (typeof text !== "string") return text;
  return text.replaceAll("+-", "±").replace(/(^|[\s(,[=])-(?=[\d.])/g, "$1−").replaceAll(" - ", " − ").replace(/(^|[\s/])u(?=m\b|s\b|N\b|Pa\b)/g, "$1µ");
}

/** A sentence of the server as the page shows it: with a capital and a full stop. */
export const ended = (text) => typeset(`${capital(text)}.`.replace(/\.\.$/, "."));

/** "no event", "1 event", "2 events". */
export function count(number, word) {
  return `${number || "no"} ${word}${number === 1 ? "" : "s"}`;
}
