// The page: tabs, theme, and the state of the server.

import { redrawAll } from "./lib/charts.js";
import { el, fill } from "./lib/dom.js";
import { dropLink, flushLink, linkTo, readLink, writeLink } from "./lib/link.js";
import { get, Refused } from "./lib/server.js";
import { useKinds } from "./lib/units.js";
import { names, setNames, useNames } from "./lib/words.js";
import * as data from "./tabs/data.js";
import * as explore from "./tabs/explore.js";
import * as map from "./tabs/map.js";
import * as paper from "./tabs/paper.js";

// A tab's module has `name`, `title`, and `create(page)`, which returns its element and
// `show(parameters)`, called each time that the tab is opened with the parameters of the link, and may
// have `hide()`, called when another tab is opened, and `renamed()`, called when numbers get other names.
const TABS = [explore, map, data, paper];

const root = document.documentElement;
const content = document.getElementById("content");
const bar = document.getElementById("tabs");
const state = document.getElementById("state");
const opened = new Map();
let current = null;

const page = {
  catalogue: null,
  /** Write a view of the tab into the address. */
  setLink(tab, parameters) {
    parameters.set("names", names());
    if (root.classList.contains("lecture")) parameters.set("letters", "large");
    else parameters.delete("letters");
    if (current === tab) writeLink(tab, parameters);
    opened.get(tab).parameters = parameters;
  },
  /** Open another tab with a view. */
  open(tab, parameters) {
    flushLink();
    location.hash = linkTo(tab, parameters);
  },
  /** Say something in the header; read out by screen readers. */
  say(text) {
    if (state.textContent !== text) state.textContent = text;
  },
};

function show() {
  dropLink();
  const { tab, parameters } = readLink();
  const module = TABS.find((t) => t.name === tab) || TABS[0];
  if (parameters.has("names")) setNames(parameters.get("names"));
  root.classList.toggle("lecture", parameters.get("letters") === "large" || Boolean(document.fullscreenElement));
  nameNames();
  if (current && current !== module.name) opened.get(current)?.hide?.();
  current = module.name;
  for (const link of bar.querySelectorAll("a")) {
    if (link.dataset.tab === current) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  if (!opened.has(current)) opened.set(current, { ...module.create(page), parameters });
  const { element } = opened.get(current);
  document.title = `${module.title} – asperity`;
  if (content.firstElementChild !== element) fill(content, element);
  opened.get(current).show(parameters);
}

function changeTheme() {
  const dark = root.dataset.theme
    ? root.dataset.theme === "dark"
    : matchMedia("(prefers-color-scheme: dark)").matches;
  root.dataset.theme = dark ? "light" : "dark";
  try {
    localStorage.setItem("asperity-theme", root.dataset.theme);
  } catch {
    // Storage may be switched off.
  }
}

function nameNames() {
  const button = document.getElementById("names");
  const geophysics = names() === "geophysics";
  button.textContent = geophysics ? "Names: a, b, D_c" : "Names: A, B, D₀";
  button.title = geophysics ? "Names of geophysics; change to A, B, D₀" : "Names of the friction paper; change to those of geophysics: a, b, D_c";
}

function changeNames() {
  setNames(names() === "geophysics" ? "friction" : "geophysics");
  nameNames();
  for (const [tab, { renamed, parameters, show: again }] of opened) {
    parameters.set("names", names());
    if (renamed) renamed();
    else if (tab === current) again(parameters);
  }
}

/** Full screen, with letters for a lecture. */
function changeScreen() {
  if (document.fullscreenElement) document.exitFullscreen();
  else if (root.classList.contains("lecture")) setLetters(false); // as a link had them
  else root.requestFullscreen();
}

function setLetters(large) {
  root.classList.toggle("lecture", large);
  page.setLink(current, opened.get(current).parameters);
  redrawAll();
}

async function start() {
  page.catalogue = await get("catalogue");
  useKinds(page.catalogue.kinds);
  useNames(page.catalogue);
  if (page.catalogue.docs) {
    const to = (file, text) => el("a", { href: `/docs/${file}.html` }, text);
    fill(document.getElementById("docs"), "Documentation: ", to("index", "all pages"), ", ", to("app", "this page"), ", ", to("nomenclature", "names and units"), ".");
  }
  fill(bar, TABS.map((t) => el("li", {}, el("a", {
    href: `#${t.name}`, "data-tab": t.name,
    click: (event) => {
      flushLink();
      // A tab that was open before comes back as it was.
      const earlier = opened.get(t.name);
      if (earlier && current !== t.name) {
        event.preventDefault();
        page.open(t.name, earlier.parameters);
      }
    },
  }, t.title))));
  document.getElementById("theme").addEventListener("click", changeTheme);
  document.getElementById("names").addEventListener("click", changeNames);
  document.getElementById("full").addEventListener("click", changeScreen);
  document.addEventListener("fullscreenchange", () => setLetters(Boolean(document.fullscreenElement)));
  addEventListener("hashchange", show);
  addEventListener("beforeprint", () => redrawAll(true));
  addEventListener("afterprint", () => redrawAll());
  show();
}

start().catch((error) => {
  if (!(error instanceof Refused)) throw error;
  fill(content, el("p", { class: "message", role: "alert" }, error.message));
});
