// Tables that scroll where they are wider than the screen, and say so.

import { el } from "./dom.js";
import { capital, ended, typeset, worded } from "./words.js";

/** A region around a table that scrolls for itself; the keyboard reaches it. */
export function scrolling(label, children, tall = false) {
  const hint = el("p", { class: "scroll-hint", "aria-hidden": "true", hidden: true });
  const holder = el("div", { class: `table-holder${tall ? " tall" : ""}`, tabindex: "0", role: "region", "aria-label": label }, children);
  const look = () => {
    const aside = holder.scrollWidth - holder.clientWidth > 1 && holder.scrollLeft <= 8;
    const below = holder.scrollHeight - holder.clientHeight > 1 && holder.scrollTop <= 8;
    hint.hidden = !aside && !below;
    hint.textContent = `Scroll in the table for more ${aside ? "→" : ""}${below ? "↓" : ""}`;
  };
  new ResizeObserver(look).observe(holder);
  holder.addEventListener("scroll", look, { passive: true });
  return el("div", { class: "table-frame" }, hint, holder);
}

/** A table of texts or elements; the first cell of a row is its head. */
export function table(head, rows, label, tall = false) {
  return scrolling(label, el("table", {},
    head.length > 0 && el("thead", {}, el("tr", {}, head.map((t) => (t ? el("th", { scope: "col" }, worded(t)) : el("td", {}))))),
    el("tbody", {}, rows.map(([first, ...others]) => el("tr", {}, el("th", { scope: "row" }, first), others.map((t) => el("td", {}, t)))))), tall);
}

/** The sections of a report, which the server words for everyone who shows it; `of` names its tables. */
export function sections(report, of = "") {
  return report.flatMap(({ title, sentences, head, rows, warnings }) => [
    title && el("h4", {}, typeset(capital(title))),
    ...sentences.map((sentence) => el("p", {}, ended(sentence))),
    rows.length && table(head, rows.map((row) => row.map(typeset)), `${title || (head.includes("estimate") ? "Parameters" : head[0] === "law" ? "Comparison" : "Numbers")}${of}`),
    ...warnings.map((warning) => el("p", { class: "message" }, ended(warning))),
  ]).filter(Boolean);
}
