// The page's address: "#tab?name=value&..." restores a view.

/** Tab and parameters of the address. */
export function readLink() {
  const [tab, query = ""] = decodeURI(location.hash.slice(1)).split("?");
  return { tab, parameters: new URLSearchParams(query) };
}

let timer = 0;

/** Write tab and parameters into the address, without a new entry in the history. */
export function writeLink(tab, parameters) {
  clearTimeout(timer);
  // Browsers refuse more than some hundred changes in half a minute.
  timer = setTimeout(() => history.replaceState(null, "", linkTo(tab, parameters)), 250);
}

/** The fragment of a view. */
export function linkTo(tab, parameters) {
  const query = parameters.toString();
  return `#${tab}${query ? `?${query}` : ""}`;
}
