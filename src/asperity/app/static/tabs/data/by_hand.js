// Sliders for the parameters of a law, whose curve is drawn over a recording.

import { Figure, series } from "../../lib/charts.js";
import { Quantity } from "../../lib/controls.js";
import { el, fill } from "../../lib/dom.js";
import { Latest } from "../../lib/server.js";
import { capital } from "../../lib/words.js";

/** Start values before a fit: typical of rocks. */
const BEGIN = { A: 0.01, B: 0.012, D0: 5e-6, "K/W0": 5e3 };
/** A slider covers this factor on both sides of its number. */
const REACH = 30;

export class ByHand {
  /** `fitFrom(start)` begins a fit at the numbers, by their names in a fit; `changed()` writes the link. */
  constructor(page, fitFrom, changed) {
    Object.assign(this, { page, fitFrom, changed });
    this.sliders = el("div", { class: "filters" });
    this.message = el("p", { class: "message", role: "alert" });
    this.figure = new Figure({
      name: "by-hand", title: "The law over the recording", height: 340,
      columns: () => this.shown && { time: this.shown.x, model: this.shown.y },
      caption: "The level and a straight trend over time are fitted to the recording; all other numbers are those of the sliders.",
    });
    this.latest = new Latest("data/model", (answer) => this.#draw(answer), (why) => { this.message.textContent = why; });
    this.element = el("details", { class: "by-hand", hidden: true },
      el("summary", {}, "Move the numbers by hand over the recording"), this.sliders, this.message, this.figure.element,
      el("div", { class: "actions" }, el("button", { type: "button", click: () => this.fitFrom(this.start()) }, "Fit from here")));
    this.element.addEventListener("toggle", () => {
      if (!this.recording) return;
      this.changed();
      if (this.element.open) this.#ask();
    });
  }

  /** What a link holds: the numbers, where the panel is open. */
  saved() {
    return this.recording && this.element.open ? JSON.stringify(this.values) : this.kept;
  }

  /** Numbers of a link, for the recording that comes. */
  restore(text) {
    this.kept = text;
  }

  renamed() {
    if (this.recording) this.#build();
  }

  /** Show a recording, unless its velocities are unknown, and a law. */
  use(recording, law) {
    const known = recording?.segments.length && recording.segments.every((s) => s.hold || s.velocity > 0) && !recording.segments[0].hold;
    this.element.hidden = !known;
    if (!known) this.recording = null;
    if (!known || (this.recording === recording && this.law === law)) return;
    Object.assign(this, { recording, law, values: null, shown: null });
    this.#build();
    this.kept = null;
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
    const defaults = Object.values(materials)[0].sliders;
    const parameters = laws[this.law].parameters.filter((p) => p.place === "law");
    if (!this.values) {
      this.values = Object.fromEntries([
        ...parameters.map((p) => [p.name, BEGIN[p.name] ?? defaults[p.name].value]), ["K/W0", BEGIN["K/W0"]],
        ...[["V0", this.recording.segments[0].velocity], ["mu0", this.recording.level]]
          .filter(([n]) => parameters.some((p) => p.name === n)),
      ]);
      this.#takeKept();
    }
    const moved = parameters.filter((p) => !["mu0", "V0"].includes(p.name));
    const stiffness = { name: "K/W0", kind: "per_length", meaning: "stiffness over the load" };
    fill(this.sliders, [...moved, stiffness].map((parameter) => {
      const value = this.values[parameter.name];
      const slider = value > 0 ? { value, low: value / REACH, high: value * REACH, log: true } : { value, low: 0, high: 1, log: false };
      return new Quantity({
        parameter, slider,
        onInput: (to) => {
          if (typeof to !== "number") {
            this.message.textContent = `${capital(parameter.meaning)} must be a number with a unit as in the field before, got “${to}”; change it.`;
            return;
          }
          this.values[parameter.name] = to;
          this.#ask();
          this.changed();
        },
      }).element;
    }));
    if (this.element.open) this.#ask();
  }

  /** Take the numbers of a link. */
  #takeKept() {
    try {
      const kept = Object.entries(JSON.parse(this.kept || "{}")).filter(([n, v]) => n in this.values && Number.isFinite(v));
      Object.assign(this.values, Object.fromEntries(kept));
      if (kept.length) this.element.open = true;
    } catch {
      // The numbers to begin with.
    }
  }

  #ask() {
    if (!this.shown) this.message.textContent = "Integrating the motion; the equations of the law are compiled first, once, which takes some seconds.";
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
    // Around the first change of the velocity; friction is straight elsewhere.
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
