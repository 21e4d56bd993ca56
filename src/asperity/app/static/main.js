// The page: tabs, theme, and the state of the server.

import { redrawAll } from "./lib/charts.js";
import { el, fill } from "./lib/dom.js";
import { dropLink, flushLink, linkTo, readLink, writeLink } from "./lib/link.js";
import { names, setNames, useNames } from "./lib/names.js";
import { get } from "./lib/server.js";
import { useKinds } from "./lib/units.js";
import * as data from "./tabs/data.js";
import * as explore from "./tabs/explore.js";
import * as map from "./tabs/map.js";
import * as paper from "./tabs/paper.js";

// A tab's module has `name`, `title`, and `create(page)`, which returns its element and
// `show(parameters)`, called each time that the tab is opened with the parameters of the link, and may
// have `hide()`, called when another tab is opened, and `renamed()`, called when numbers get other names.
const TABS = [explore, map, data, paper];

const content = document.getElementById("content");
const bar = document.getElementById("tabs");
const state = document.getElementById("state");
const opened = new Map();
let current = null;

const page = {
  catalogue: null,
  /** Write a view of the tab into the address. */
  setLink(tab, parameters) {
    if (names() === "geophysics") parameters.set("names", names());
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
  const root = document.documentElement;
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
  button.textContent = geophysics ? "a, b, D_c" : "A, B, D₀";
  button.setAttribute("aria-label", geophysics ? "Names of geophysics: a, b, D_c. Change to A, B, D0" : "Names: A, B, D0. Change to those of geophysics, a, b, D_c");
}

function changeNames() {
  setNames(names() === "geophysics" ? "friction" : "geophysics");
  nameNames();
  for (const [tab, { renamed, parameters, show: again }] of opened) {
    parameters.delete("names");
    if (renamed) renamed();
    else if (tab === current) again(parameters);
  }
}

/** Full screen, with letters for a lecture. */
function changeScreen() {
  if (document.fullscreenElement) document.exitFullscreen();
  else document.documentElement.requestFullscreen();
}

let resized = 0;

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
  document.addEventListener("fullscreenchange", () => {
    document.documentElement.classList.toggle("lecture", Boolean(document.fullscreenElement));
    redrawAll();
  });
  addEventListener("hashchange", show);
  addEventListener("resize", () => {
    clearTimeout(resized);
    resized = setTimeout(() => redrawAll(matchMedia("print").matches), 120);
  });
  addEventListener("beforeprint", () => redrawAll(true));
  addEventListener("afterprint", () => redrawAll());
  show();
}

start();
