// Figures as SVG. They follow a slider: a general chart library takes 100 ms for the figures of Explore, this file some 10. Colours are classes of the style sheet, so that light, dark and
// print need no redrawing.

import { el, fresh, shape } from "./dom.js";
import { csv, saveFile } from "./save.js";
import { digits } from "./units.js";
import { worded } from "./words.js";

const figures = new Set();
let printing = false;

/** Time (ms) after which a figure out of sight follows. */
const REST = 150;
/** Width (px) of a figure across a sheet of A4. */
const PRINTED = 680;

const RIGHT = 14;
/** Room (px) for the label of the axis upwards, and for a character of its ticks. */
const LABEL = 32;
const CHARACTER = 6.6;
const TOP = 10;
const BOTTOM = 42;
const GAP = 16;
/** Room (px) for a colour bar with its numbers. */
const BAR = 92;

/** Size of letters over that for which the room is. */
const letters = () => parseFloat(getComputedStyle(document.documentElement).fontSize) / 15;

/** Class of the colour of a series, counted from 0. */
export function series(index) {
  return `s${(index % 6) + 1}`;
}

/** A line of a legend: the line, or the point, of a class, and what it is. */
export function key(cls, ...text) {
  const mark = cls.startsWith("point") ? shape("circle", { class: cls, cx: 12, cy: 4, r: 4 }) : shape("path", { class: `line thick ${cls}`, d: "M0 4H24" });
  return el("p", { class: "key" }, shape("svg", { class: "swatch", viewBox: "0 0 24 8", "aria-hidden": "true" }, mark), ...text);
}

/**
 * A figure with a title, a note and buttons that save it.
 *
 * `columns()` returns what the CSV holds: arrays by name. `options` are elements next to the title.
 * `ownLabel` says what the keyboard does on the chart where that is not reading values.
 * `onSpan(from, to)` is called with the ends, in units of x, of what is dragged over with the mouse.
 */
export class Figure {
  constructor({ name, title, height = 240, columns, options, caption = "", ownLabel = "", onSpan = null }) {
    Object.assign(this, { name, title, height, columns, ownLabel, onSpan });
    this.readout = el("div", { class: "readout", "aria-hidden": "true" });
    this.spoken = el("div", { class: "visually-hidden", "aria-live": "polite" });
    this.plot = el("div", {
      class: "plot", tabindex: "0", role: "group",
      pointermove: (e) => this.#hover(e), pointerleave: () => this.#hover(null),
      keydown: (e) => this.#read(e), blur: () => this.#forget(),
    });
    this.plot.style.minHeight = `${height}px`; // nothing moves when the picture comes
    if (ownLabel) this.plot.setAttribute("aria-label", ownLabel);
    // A chart may be drawn before its figure, or the panels beside it, are on the page.
    new ResizeObserver(() => {
      if (this.chart && !printing && this.plot.clientWidth !== this.width) this.#paint();
    }).observe(this.plot);
    this.note = el("div", { class: "note" });
    const label = fresh("figure");
    const button = (text, what, act) => el("button", {
      type: "button", class: "quiet small", "aria-label": `${title}: save ${what}`, click: act,
    }, text);
    this.heading = el("h3", { id: label }, worded(title));
    this.element = el(
      "figure",
      { class: `panel ${name}`, "aria-labelledby": label },
      el("figcaption", {}, this.heading, options,
        el("span", { class: "exports" },
          button("SVG", "as SVG", () => this.#saveSvg()),
          button("PNG", "as PNG", () => this.#savePng()),
          button("CSV", "the numbers as CSV", () => this.#saveCsv()))),
      el("div", { class: "stage" }, this.plot, this.readout, this.spoken),
      this.note,
      caption && el("p", { class: "note caption" }, caption),
    );
    if (onSpan) this.#spans();
    figures.add(this);
  }

  /**
   * Show a chart.
   *
   * `chart.x` is an axis and `chart.rows` are panels above each other, each with an axis `y`. An
   * axis has `label`, `log`, `range` (else that of the data) and `format`, from a number to a text.
   * A row has `lines` and `points` ({x, y, cls, name, title}), `bars` ({x, y, cls, name}), `marks`
   * (x of vertical lines), `circle` (its radius), `image` ({url, x, y}: corners), `words` ([text, x, y]
   * in shares of the axes), `colours` ({stops, low, high, label}: a colour bar), `equal` (both axes with
   * the same scale) and `text` (in the middle). A line may be `thick`, `dashed` or `smooth`.
   * `description` says in words what there is to see.
   */
  draw(chart, description = "") {
    this.chart = chart;
    this.description = description;
    clearTimeout(this.later);
    const { top, bottom } = this.element.getBoundingClientRect();
    // What is not in sight can wait until the slider rests.
    if (this.frames && !printing && (bottom < 0 || top > window.innerHeight)) this.later = setTimeout(() => this.#paint(), REST);
    else this.#paint();
  }

  #paint() {
    const { chart, description } = this;
    const height = this.height * letters();
    this.plot.style.minHeight = `${height}px`;
    if (!this.ownLabel) this.plot.setAttribute("aria-label", `${this.heading.textContent}: arrow keys read its values`);
    const width = printing ? this.#printedWidth() : this.plot.clientWidth;
    // While the layout changes a panel may be narrower than its margins.
    if (width <= 10 * RIGHT) return;
    this.width = width;
    const drawn = drawChart(chart, width, height, description);
    this.plot.innerHTML = drawn.svg;
    this.frames = drawn.frames;
    if (this.cursor) this.#showCursor();
  }

  /** Width on paper: two figures in a row, or a single figure. */
  #printedWidth() {
    const paired = this.element.parentElement?.classList.contains("panels") && this.name !== "whole";
    return paired ? PRINTED / 2 - 20 : PRINTED;
  }

  /** Position of an event in px, and the number of its row; -1 outside of all rows. */
  #place(event) {
    const box = this.plot.getBoundingClientRect();
    const [px, py] = [event.clientX - box.left, event.clientY - box.top];
    const inside = (f) => px >= f.left && px <= f.right && py >= f.top && py <= f.bottom;
    return [px, py, this.frames ? this.frames.findIndex(inside) : -1];
  }

  /** Position of an event in units of the axes of its row; null outside. */
  at(event) {
    const [px, py, k] = this.#place(event);
    return k < 0 ? null : [this.frames[k].x.back(px), this.frames[k].y.back(py)];
  }

  /** Let the mouse drag over a stretch of x. A finger scrolls the page. */
  #spans() {
    const band = el("div", { class: "span", hidden: true });
    let from = null;
    const inside = (event) => {
      const { left, right } = this.frames[0];
      return Math.max(left, Math.min(right, this.#place(event)[0]));
    };
    const show = (event) => {
      const ends = [from, inside(event)].sort((a, b) => a - b);
      band.hidden = ends[1] - ends[0] < 4;
      band.style.left = `${ends[0]}px`;
      band.style.width = `${ends[1] - ends[0]}px`;
      return ends;
    };
    this.plot.classList.add("spans");
    this.plot.after(band);
    this.plot.addEventListener("pointerdown", (event) => {
      if (event.pointerType === "touch" || event.button || !this.at(event)) return;
      from = inside(event);
      this.plot.setPointerCapture(event.pointerId);
    });
    this.plot.addEventListener("pointermove", (event) => { if (from !== null) show(event); });
    this.plot.addEventListener("pointerup", (event) => {
      if (from === null) return;
      const ends = show(event);
      const wide = !band.hidden;
      from = null;
      band.hidden = true;
      if (wide) this.onSpan(...ends.map((px) => Number(this.frames[0].x.back(px).toPrecision(6))));
    });
    this.plot.addEventListener("pointercancel", () => { from = null; band.hidden = true; });
  }

  #hover(event) {
    const [px, py, k] = event ? this.#place(event) : [0, 0, -1];
    this.#show(k < 0 ? "" : this.#under(px, py, k), px, py);
  }

  #show(text, x, y) {
    this.readout.hidden = !text;
    if (!text) return;
    this.readout.textContent = text;
    const box = this.plot.getBoundingClientRect();
    const wide = this.readout.offsetWidth;
    this.readout.style.left = `${Math.max(0, Math.min(x + 12, box.width - wide))}px`;
    this.readout.style.top = `${Math.max(0, y - this.readout.offsetHeight - 10)}px`;
  }

  #under(px, py, k) {
    const frame = this.frames[k];
    const row = this.chart.rows[k];
    if (row.readout) return row.readout(frame.x.back(px), frame.y.back(py));
    let best = null;
    for (const kind of ["points", "bars", "lines"]) {
      for (const item of row[kind] || []) {
        for (let i = 0; i < item.x.length; i += 1) {
          const y = item.y[i];
          if (!isKnown(y)) continue;
          const dx = frame.x.to(item.x[i]) - px;
          const dy = frame.y.to(y) - py;
          const far = kind === "bars" ? Math.abs(dx) : Math.hypot(dx, kind === "lines" ? 0.35 * dy : dy);
          if (far < 24 && (!best || far < best.far)) best = { far, item, i, y };
        }
      }
    }
    return best ? this.#words(row, best.item, best.i) : "";
  }

  #words(row, item, i) {
    const y = item.y[i];
    if (item.title) return typeof item.title === "function" ? item.title(i) : item.title;
    const name = item.name ? `${item.name}: ` : "";
    return `${name}${(row.y.format || digits)(y)} at ${(this.chart.x.format || digits)(item.x[i])}`;
  }

  // --- With the keyboard: arrows to the sides follow a curve, up and down change the curve ----

  /** Every curve, row of points and row of bars that has a value, with the number of its row. */
  #tracks() {
    return this.chart.rows.flatMap((row, k) => ["lines", "bars", "points"].flatMap((kind) =>
      (row[kind] || []).filter((item) => item.y.some(isKnown)).map((item) => ({ k, row, item }))));
  }

  #read(event) {
    const steps = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0] }[event.key];
    if (event.key === "Escape") this.#forget();
    if (!steps || !this.frames || this.ownLabel) return;
    event.preventDefault();
    const tracks = this.#tracks();
    if (!tracks.length) return;
    const inside = (n, count) => Math.max(0, Math.min(count - 1, n));
    if (!this.cursor) this.cursor = { track: 0, i: tracks[0].item.y.findIndex(isKnown) };
    else {
      const old = tracks[inside(this.cursor.track, tracks.length)];
      const at = old.item.x[inside(this.cursor.i, old.item.x.length)];
      const track = inside(this.cursor.track + steps[0], tracks.length);
      const { item } = tracks[track];
      const known = item.y.map((_, i) => i).filter((i) => isKnown(item.y[i]));
      let i = known.reduce((best, n) => (Math.abs(item.x[n] - at) < Math.abs(item.x[best] - at) ? n : best), known[0]);
      if (steps[1]) i = known[inside(known.indexOf(i) + steps[1] * Math.ceil(known.length / 64), known.length)];
      this.cursor = { track, i };
    }
    this.#showCursor();
  }

  #showCursor() {
    const tracks = this.#tracks();
    const track = tracks[Math.min(this.cursor.track, tracks.length - 1)];
    const i = track && Math.min(this.cursor.i, track.item.x.length - 1);
    if (!track || !isKnown(track.item.y[i])) return this.#forget();
    const frame = this.frames[track.k];
    const [x, y] = [frame.x.to(track.item.x[i]), clampPixel(frame.y.to(track.item.y[i]))];
    this.plot.querySelector(".cursor")?.remove();
    this.plot.querySelector("svg").append(shape("circle", { class: "cursor", cx: round(x), cy: round(y), r: 8 }));
    const text = this.#words(track.row, track.item, i);
    const label = track.row.y.label && !track.item.title ? `${track.row.y.label}: ` : "";
    this.#show(text, x, y);
    this.spoken.textContent = label + text;
    return undefined;
  }

  #forget() {
    this.cursor = null;
    this.plot.querySelector(".cursor")?.remove();
    this.readout.hidden = true;
    this.spoken.textContent = "";
  }

  #saveSvg() {
    const svg = this.#styled();
    if (svg) saveFile(`${this.name}.svg`, svg, "image/svg+xml");
  }

  #savePng() {
    const svg = this.#styled();
    if (!svg) return;
    const image = new Image();
    image.onload = () => {
      const canvas = document.createElement("canvas");
      canvas.width = 3 * image.width;
      canvas.height = 3 * image.height;
      canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
      canvas.toBlob((blob) => saveFile(`${this.name}.png`, blob));
    };
    image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svg)}`;
  }

  /** The picture with its styles written into it, on the page's surface. */
  #styled() {
    const shown = this.plot.querySelector("svg");
    if (!shown) return null;
    const copy = shown.cloneNode(true);
    copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
    const from = shown.querySelectorAll("*");
    const gone = [];
    copy.querySelectorAll("*").forEach((node, i) => {
      const style = getComputedStyle(from[i]);
      for (const property of ["fill", "stroke", "stroke-width", "stroke-dasharray", "stroke-linecap", "paint-order", "font-size", "font-family", "opacity"]) {
        const value = style.getPropertyValue(property);
        if (value) node.setAttribute(property, value);
      }
      if (node.classList.contains("cursor")) gone.push(node);
      node.removeAttribute("class");
    });
    for (const node of gone) node.remove();
    copy.prepend(shape("rect", { width: "100%", height: "100%", fill: getComputedStyle(this.element).backgroundColor }));
    return new XMLSerializer().serializeToString(copy);
  }

  #saveCsv() {
    const columns = this.columns && this.columns();
    if (columns) saveFile(`${this.name}.csv`, csv(columns), "text/csv");
  }
}

/** Whether a value is a number: gaps of curves are null. */
const isKnown = Number.isFinite;

/** Draw everything again, with other letters or for paper. */
export function redrawAll(onPaper = false) {
  printing = onPaper;
  for (const figure of figures) {
    if (figure.chart && figure.element.isConnected) figure.draw(figure.chart, figure.description);
  }
}

// --- Drawing ---------------------------------------------------------------------------------

function drawChart(chart, width, height, description) {
  const { rows } = chart;
  const size = letters();
  const below = BOTTOM * size;
  const each = (height - TOP - below - GAP * (rows.length - 1)) / rows.length;
  const frames = [];
  const parts = [];
  const yRanges = rows.map((row) => row.y.range || extent(itemsOf(row).flatMap((i) => i.y), row.y.log, 0.06));
  const longest = Math.max(2, ...rows.flatMap((row, k) =>
    ticks(scale(yRanges[k], 1, 0, row.y.log), row.y, each / 30 / size).map((t) => t.label.length)));
  const LEFT = Math.min(0.4 * width, size * (LABEL + CHARACTER * longest));
  let xRange = chart.x.range || extent(rows.flatMap((r) => itemsOf(r).flatMap((i) => i.x)), chart.x.log, 0);
  rows.forEach((row, k) => {
    const top = TOP + k * (each + GAP);
    const frame = { left: LEFT, right: width - RIGHT - (row.colours ? BAR * size : 0), top, bottom: top + each };
    let yRange = yRanges[k];
    if (row.equal) [xRange, yRange] = equal(frame, xRange, yRange);
    frame.x = scale(xRange, frame.left, frame.right, chart.x.log);
    frame.y = scale(yRange, frame.bottom, frame.top, row.y.log);
    frames.push(frame);
    parts.push(drawRow(row, frame, chart.x, k === rows.length - 1, size));
  });
  const foot = frames[frames.length - 1];
  // A label that is longer than its axis has the whole width.
  const long = 6.4 * size * chart.x.label.length > foot.right - foot.left;
  parts.push(text(long ? width / 2 : (foot.left + foot.right) / 2, height - 6, worded(chart.x.label), "axis-label", "middle"));
  return {
    frames,
    svg: `<svg width="${width}" height="${height}" viewBox="0 0 ${width} ${height}" role="img" aria-label="${escape(description)}">${parts.join("")}</svg>`,
  };
}

function itemsOf(row) {
  return [...(row.lines || []), ...(row.points || []), ...(row.bars || [])];
}

function drawRow(row, frame, x, last, size) {
  const { left, right, top, bottom } = frame;
  const parts = [];
  const clip = fresh("clip");
  parts.push(`<clipPath id="${clip}"><rect x="${left}" y="${top - 1}" width="${right - left}" height="${bottom - top + 2}"/></clipPath>`);
  for (const t of ticks(frame.y, row.y, (bottom - top) / 30 / size)) {
    const y = round(frame.y.to(t.value));
    parts.push(`<path class="grid" d="M${left} ${y}H${right}"/>`);
    parts.push(text(left - 7, y + 4, t.label, "tick-label", "end"));
  }
  for (const t of ticks(frame.x, x, (right - left) / 70 / size)) {
    const px = round(frame.x.to(t.value));
    parts.push(`<path class="grid" d="M${px} ${top}V${bottom}"/>`);
    if (last) parts.push(text(px, bottom + 17 * size, t.label, "tick-label", "middle"));
  }
  parts.push(`<g clip-path="url(#${clip})">`);
  if (row.image?.url) parts.push(drawImage(row.image, frame));
  for (const mark of row.marks || []) {
    const px = round(frame.x.to(mark));
    parts.push(`<path class="mark" d="M${px} ${top}V${bottom}"/>`);
  }
  if (row.circle) {
    const radius = frame.x.to(row.circle) - frame.x.to(0);
    parts.push(`<circle class="circle" cx="${round(frame.x.to(0))}" cy="${round(frame.y.to(0))}" r="${round(radius)}"/>`);
  }
  for (const bars of row.bars || []) {
    const wide = Math.min(28, 0.55 * Math.abs(frame.x.to(bars.x[1] ?? 1) - frame.x.to(bars.x[0] ?? 0)));
    bars.x.forEach((at, i) => {
      if (!(bars.y[i] > 0) && row.y.log) return;
      const y = frame.y.to(bars.y[i]);
      const foot = row.y.log ? bottom : frame.y.to(0);
      parts.push(`<rect class="bar ${bars.cls}" x="${round(frame.x.to(at) - wide / 2)}" y="${round(Math.min(y, foot))}" width="${round(wide)}" height="${round(Math.abs(foot - y))}"/>`);
    });
  }
  for (const line of row.lines || []) parts.push(drawLine(line, frame));
  for (const points of row.points || []) {
    points.x.forEach((at, i) => {
      if (!isKnown(points.y[i])) return;
      const px = round(frame.x.to(at));
      const py = round(frame.y.to(points.y[i]));
      parts.push(points.cross
        ? `<path class="cross ${points.cls}" d="M${px - 5} ${py - 5}l10 10m0 -10l-10 10"/>`
        : `<circle class="point ${points.cls}" cx="${px}" cy="${py}" r="${points.size || 5.5}"/>`);
    });
  }
  parts.push("</g>", `<path class="frame" d="M${left} ${top}V${bottom}H${right}"/>`);
  const middle = (top + bottom) / 2;
  parts.push(`<text class="axis-label" text-anchor="middle" transform="translate(${round(14 * size)} ${round(middle)}) rotate(-90)">${escape(worded(row.y.label))}</text>`);
  for (const [word, sx, sy] of row.words || []) parts.push(text(left + sx * (right - left), bottom - sy * (bottom - top) + 4, word, "region", "middle"));
  if (row.colours) parts.push(drawColours(row.colours, frame, size));
  if (row.text) parts.push(text((left + right) / 2, middle, row.text, "nothing", "middle"));
  return parts.join("");
}

/** A colour bar to the right of a frame. */
function drawColours({ stops, low, high, label }, { right, top, bottom }, size) {
  const id = fresh("colours");
  const x = right + 14;
  const to = scale([low, high], bottom, top);
  const marks = ticks(to, {}, (bottom - top) / 45 / size)
    .map((t) => `<path class="frame" d="M${x + 14} ${round(to.to(t.value))}h4"/>${text(x + 21, to.to(t.value) + 4, t.label, "tick-label", "start")}`);
  return `<defs><linearGradient id="${id}" x1="0" y1="1" x2="0" y2="0">${stops.map((s) => `<stop offset="${s.offset}" stop-color="${s.colour}"/>`).join("")}</linearGradient></defs>`
    + `<rect x="${x}" y="${top}" width="14" height="${bottom - top}" fill="url(#${id})"/>${marks.join("")}`
    + `<text class="axis-label" text-anchor="middle" transform="translate(${round(right + (BAR - 4) * size)} ${round((top + bottom) / 2)}) rotate(-90)">${escape(label)}</text>`;
}

/** Cubic curves through points that rise and fall where the points do (Fritsch and Carlson, 1980). */
function smoothPath(points) {
  const n = points.length;
  const slope = points.slice(1).map(([x, y], i) => (y - points[i][1]) / (x - points[i][0]));
  const at = points.map((_, i) => {
    if (i === 0) return slope[0];
    if (i === n - 1) return slope[n - 2];
    return slope[i - 1] * slope[i] <= 0 ? 0 : (2 * slope[i - 1] * slope[i]) / (slope[i - 1] + slope[i]);
  });
  return points.map(([x, y], i) => {
    if (i === 0) return `M${round(x)} ${round(y)}`;
    const [px, py] = points[i - 1];
    const third = (x - px) / 3;
    return `C${round(px + third)} ${round(py + third * at[i - 1])} ${round(x - third)} ${round(y - third * at[i])} ${round(x)} ${round(y)}`;
  }).join("");
}

function drawLine(line, frame) {
  const runs = [[]];
  line.x.forEach((x, i) => {
    if (isKnown(line.y[i])) runs.at(-1).push([frame.x.to(x), clampPixel(frame.y.to(line.y[i]))]);
    else if (runs.at(-1).length) runs.push([]);
  });
  const straight = (points) => `M${points.map(([x, y]) => `${round(x)} ${round(y)}`).join("L")}`;
  const path = runs.filter((points) => points.length > 1).map(line.smooth ? smoothPath : straight).join("");
  return path ? `<path class="line ${line.cls} ${line.thick ? "thick" : ""} ${line.dashed ? "dashed" : ""}" d="${path}"/>` : "";
}

function drawImage(image, frame) {
  const [x0, x1] = image.x.map((v) => frame.x.to(v));
  const [y0, y1] = image.y.map((v) => frame.y.to(v));
  return `<image href="${image.url}" x="${round(x0)}" y="${round(y1)}" width="${round(x1 - x0)}" height="${round(y0 - y1)}" preserveAspectRatio="none" class="map-image"/>`;
}

/** Browsers draw nothing of paths that run too far off the screen. */
function clampPixel(value) {
  return Math.max(-2000, Math.min(4000, value));
}

function text(x, y, content, cls, anchor) {
  return `<text class="${cls}" x="${round(x)}" y="${round(y)}" text-anchor="${anchor}">${escape(content)}</text>`;
}

const round = (value) => Math.round(value * 10) / 10;

const ESCAPES = { "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "'": "&#39;" };
const escape = (value) => String(value).replace(/[&<>"']/g, (c) => ESCAPES[c]);

// --- Axes ------------------------------------------------------------------------------------

function extent(values, log, margin) {
  let low = Infinity;
  let high = -Infinity;
  for (const v of values) {
    if (!isKnown(v) || (log && v <= 0)) continue;
    if (v < low) low = v;
    if (v > high) high = v;
  }
  if (low > high) return log ? [0.1, 10] : [0, 1];
  if (log) {
    const far = (high / low) ** margin;
    return low === high ? [low / 2, high * 2] : [low / far, high * far];
  }
  // What differs by rounding only is a constant.
  if (high - low <= 1e-9 * Math.max(Math.abs(low), Math.abs(high))) {
    const pad = Math.abs(high) * 0.05 || 1;
    return [low - pad, high + pad];
  }
  return [low - margin * (high - low), high + margin * (high - low)];
}

/** Ranges with the same scale, about the same centres. */
function equal(frame, [x0, x1], [y0, y1]) {
  const unit = Math.max((x1 - x0) / (frame.right - frame.left), (y1 - y0) / (frame.bottom - frame.top));
  const around = (low, high, size) => [(low + high - unit * size) / 2, (low + high + unit * size) / 2];
  return [around(x0, x1, frame.right - frame.left), around(y0, y1, frame.bottom - frame.top)];
}

function scale([low, high], from, to, log) {
  const f = log ? Math.log10 : (v) => v;
  const [a, b] = [f(low), f(high)];
  const back = (p) => a + ((p - from) / (to - from)) * (b - a);
  return {
    low, high, log,
    to: (v) => from + ((f(v) - a) / (b - a)) * (to - from),
    back: (p) => (log ? 10 ** back(p) : back(p)),
  };
}

function ticks({ low, high, log }, axis, most) {
  const label = axis.format || digits;
  if (axis.ticks) return axis.ticks.map((value) => ({ value, label: label(value) }));
  if (log) {
    const powers = [];
    const first = Math.ceil(Math.log10(low) - 1e-9);
    const last = Math.floor(Math.log10(high) + 1e-9);
    const step = Math.max(1, Math.ceil((last - first + 1) / Math.max(2, most)));
    for (let p = first; p <= last; p += step) powers.push(10 ** p);
    if (powers.length >= 2) return powers.map((value) => ({ value, label: label(Number(value.toPrecision(3))) }));
    const values = [];
    for (let p = first - 1; p <= last; p += 1) values.push(...[1, 2, 5].map((m) => Number(`${m}e${p}`)));
    return values.filter((value) => value >= low && value <= high).map((value) => ({ value, label: label(value) }));
  }
  const rough = (high - low) / Math.max(2.5, most);
  const power = 10 ** Math.floor(Math.log10(rough));
  const steps = [10, 5, 2.5, 2, 1, 0.5].filter((m) => m * power < 5 * rough);
  const multiples = (step) => {
    const first = Math.ceil(low / step - 1e-9);
    const count = Math.floor(high / step + 1e-9) - first + 1;
    return Array.from({ length: Math.max(0, count) }, (_, n) => Number(((first + n) * step).toPrecision(12)));
  };
  // The fewest ticks that give a scale, two at least, else as many as fit.
  const fitting = steps.map((m) => multiples(m * power)).filter((t) => t.length >= 2);
  const chosen = fitting.findLast((t) => t.length <= Math.max(2.5, most) + 0.5) || fitting[0] || multiples(rough);
  return chosen.map((value) => ({ value, label: label(value, 8) }));
}
