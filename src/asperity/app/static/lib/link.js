// The page's address: "#tab?name=value&..." restores a view.

/** Tab and parameters of the address. */
export function readLink() {
  const [tab, query = ""] = decodeURI(location.hash.slice(1)).split("?");
  return { tab, parameters: new URLSearchParams(query) };
}

let timer = 0;
let pending = null;

/** Write tab and parameters into the address, without a new entry in the history. */
export function writeLink(tab, parameters) {
  dropLink();
  pending = { tab, address: linkTo(tab, parameters) };
  // Browsers refuse more than some hundred changes in half a minute.
  timer = setTimeout(flushLink, 250);
}

/** Write at once what waits: before the address changes to that of another view. */
export function flushLink() {
  // The Back button changes the address some time before the page gets the event.
  const here = readLink().tab;
  const same = pending !== null && (here === "" || here === pending.tab);
  if (same) history.replaceState(null, "", pending.address);
  dropLink();
}

/** Forget what waits: the address is another view's by now. */
export function dropLink() {
  clearTimeout(timer);
  pending = null;
}

/** The fragment of a view. */
export function linkTo(tab, parameters) {
  const query = parameters.toString();
  return `#${tab}${query ? `?${query}` : ""}`;
}
