// Words of sentences.

/** A sentence with a capital at its beginning, unless it begins with the name of a number or a law. */
export function capital(text) {
  const [first, second] = text.split(" ", 2);
  const isName = !/^[a-z]{2,}[,:]?$/.test(first) || second === "must";
  return isName ? text : text.charAt(0).toUpperCase() + text.slice(1);
}

/** "no event", "1 event", "2 events". */
export function count(number, word) {
  return `${number || "no"} ${word}${number === 1 ? "" : "s"}`;
}
