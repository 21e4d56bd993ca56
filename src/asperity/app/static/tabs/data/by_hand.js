// A law's numbers moved by hand over a recording; the curve of the law follows at once.

import { Figure, series } from "../../lib/charts.js";
import { Quantity } from "../../lib/controls.js";
import { el, fill } from "../../lib/dom.js";
import { Latest, Refused } from "../../lib/server.js";

/** Numbers to begin with, where no fit has been made: usual ones of rocks. */
const BEGIN = { A: 0.01, B: 0.012, D0: 5e-6, "K/W0": 5e3 };
/** A slider covers this factor on both sides of its number. */
const REACH = 30;

export class ByHand {
  /** `fitFrom(start)` begins a fit at the numbers, by their names in a fit. */
  constructor(page, fitFrom) {
    Object.assign(this, { page, fitFrom });
    this.sliders = el("div", { class: "filters" });
    this.message = el("p", { class: "message", role: "alert" });
    this.figure = new Figure({
      name: "by-hand", title: "The law over the recording", height: 340,
      columns: () => this.shown && { time: this.shown.x, model: this.shown.y },
      caption: "The level and a straight trend over time are fitted to the recording; the rest is as the sliders say.",
    });
    this.latest = new Latest("data/model", (answer) => this.#draw(answer), (error) => {
      if (!(error instanceof Refused)) throw error;
      this.message.textContent = error.message;
    });
    this.element = el("details", { class: "by-hand", hidden: true },
      el("summary", {}, "Move the numbers by hand over the recording"), this.sliders, this.message, this.figure.element,
      el("div", { class: "actions" }, el("button", { type: "button", click: () => this.fitFrom(this.start()) }, "Fit from here")));
    this.element.addEventListener("toggle", () => { if (this.element.open && this.recording) this.#ask(); });
  }

  /** The one recording with known velocities, or null; and the law. */
  use(recording, law) {
    const known = recording?.segments.length && recording.segments.every((s) => s.hold || s.velocity > 0) && !recording.segments[0].hold;
    this.element.hidden = !known;
    if (!known) this.recording = null;
    if (!known || (this.recording === recording && this.law === law)) return;
    Object.assign(this, { recording, law, values: null });
    this.#build();
  }

  /** Take the numbers of a fit. */
  take(fit) {
    if (!this.recording || fit.law !== this.law) return;
    for (const [name, { value }] of Object.entries(fit.parameters)) {
      if (name === "K") this.values["K/W0"] = value / this.recording.load;
      else if (name in this.values) this.values[name] = value;
    }
    this.#build();
  }

  /** Values by name as a fit starts from them. */
  start() {
    const { "K/W0": stiffness, V0, mu0, ...law } = this.values;
    return { ...law, K: stiffness * this.recording.load };
  }

  #build() {
    const { laws, materials } = this.page.catalogue;
    const usual = Object.values(materials)[0].sliders;
    const own = laws[this.law].parameters.filter((p) => p.place === "law");
    this.values ||= Object.fromEntries([
      ...own.map((p) => [p.name, BEGIN[p.name] ?? usual[p.name].value]), ["K/W0", BEGIN["K/W0"]],
      ["V0", this.recording.segments[0].velocity], ["mu0", this.recording.level],
    ]);
    const moved = own.filter((p) => !["mu0", "V0"].includes(p.name));
    const stiffness = { name: "K/W0", kind: "per_length", meaning: "stiffness over the load" };
    fill(this.sliders, [...moved, stiffness].map((parameter) => {
      const value = this.values[parameter.name];
      const slider = value > 0 ? { value, low: value / REACH, high: value * REACH, log: true } : { value, low: 0, high: 1, log: false };
      return new Quantity({
        parameter, slider,
        onInput: (to) => { if (typeof to === "number") { this.values[parameter.name] = to; this.#ask(); } },
      }).element;
    }));
    if (this.element.open) this.#ask();
  }

  #ask() {
    const segments = this.recording.segments.map((s) => [s.end - s.start, s.hold ? 0 : s.velocity]);
    this.latest.ask({ law: this.law, numbers: this.values, segments });
  }

  #draw({ time, friction, stopped }) {
    this.message.textContent = stopped ? `The motion ends: ${stopped}.` : "";
    const { curve, segments } = this.recording;
    const from = segments[0].start;
    const at = time.map((t) => t + from);
    const model = interpolated(at, friction);
    const known = curve.x.map((x, i) => [x, curve.y[i] === null ? null : curve.y[i] - model(x)]).filter(([x, d]) => d !== null && x >= from && x <= at.at(-1));
    const trend = line(known);
    this.shown = { x: at, y: friction.map((f, i) => f + trend(at[i])) };
    const change = segments[1]?.start;
    // What is around the first change of the velocity: the rest is straight.
    const near = change === undefined ? null : [change - 0.15 * (segments[1].end - change), change + 0.4 * (segments[1].end - change)];
    const lines = [{ ...curve, cls: series(5), name: "recorded" }, { ...this.shown, cls: series(1), thick: true, name: `${this.law} by hand` }];
    const cut = ({ x, y, ...style }) => {
      const some = x.map((v, i) => i).filter((i) => x[i] >= near[0] && x[i] <= near[1]);
      return { ...style, x: some.map((i) => x[i]), y: some.map((i) => y[i]) };
    };
    this.figure.draw({ x: { label: "time (s)" }, rows: [{ y: { label: "F/W" }, lines: near ? lines.map(cut) : lines }] },
      "Recorded friction and the law by hand, from the first change of the velocity.");
  }
}

/** A function that interpolates between points of rising x. */
function interpolated(x, y) {
  return (at) => {
    let [low, high] = [0, x.length - 1];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (x[middle] <= at) low = middle; else high = middle;
    }
    return y[low] + ((y[high] - y[low]) * (at - x[low])) / (x[high] - x[low] || 1);
  };
}

/** The straight line of least squares through points, as a function. */
function line(points) {
  const n = points.length || 1;
  const [mx, my] = [0, 1].map((k) => points.reduce((sum, p) => sum + p[k], 0) / n);
  const power = points.reduce((sum, [x]) => sum + (x - mx) ** 2, 0);
  const slope = power ? points.reduce((sum, [x, y]) => sum + (x - mx) * (y - my), 0) / power : 0;
  return (x) => my + slope * (x - mx);
}
