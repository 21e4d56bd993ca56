// Tables that scroll where they are wider than the screen, and say so.

import { el } from "./dom.js";
import { worded } from "./names.js";

/** A region around a table that scrolls for itself; the keyboard reaches it. */
export function scrolling(label, children, tall = false) {
  const hint = el("p", { class: "scroll-hint", "aria-hidden": "true", hidden: true }, "Scroll to the side for more →");
  const holder = el("div", { class: `table-holder${tall ? " tall" : ""}`, tabindex: "0", role: "region", "aria-label": label }, children);
  const look = () => { hint.hidden = holder.scrollWidth <= holder.clientWidth + 1; };
  new ResizeObserver(look).observe(holder);
  holder.addEventListener("scroll", () => { if (holder.scrollLeft > 8) hint.hidden = true; }, { passive: true });
  return el("div", { class: "table-frame" }, hint, holder);
}

/** A table of texts or elements; the first cell of a row is its head. */
export function table(head, rows, label, tall = false) {
  return scrolling(label, el("table", {},
    head.length && el("thead", {}, el("tr", {}, head.map((t) => (t ? el("th", { scope: "col" }, worded(t)) : el("td", {}))))),
    el("tbody", {}, rows.map(([first, ...others]) => el("tr", {}, el("th", { scope: "row" }, first), others.map((t) => el("td", {}, t)))))), tall);
}

/** The sections of a report, as the server describes it once for all who render it; `of` names its tables. */
export function sections(report, of = "") {
  return report.flatMap(({ title, sentences, head, rows, warnings }) => [
    title && el("h4", {}, title),
    ...sentences.map((sentence) => el("p", {}, `${sentence}.`.replace(/\.\.$/, "."))),
    rows.length && table(head, rows, `${title || (head.includes("estimate") ? "Parameters" : head[0] === "law" ? "Comparison" : "Numbers")}${of}`),
    ...warnings.map((warning) => el("p", { class: "message" }, warning)),
  ]).filter(Boolean);
}
