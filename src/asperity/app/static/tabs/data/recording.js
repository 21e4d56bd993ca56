// A recording: channels as understood, corrections by hand, what was measured.

import { Figure, series } from "../../lib/charts.js";
import { choice, textField, tick } from "../../lib/controls.js";
import { el, fill } from "../../lib/dom.js";
import { copies, saveFile, saveRows } from "../../lib/save.js";
import { scrolling, sections, table } from "../../lib/tables.js";
import { Task } from "../../lib/task.js";
import { digits, quantity, withDoubt, written } from "../../lib/units.js";
import { count, ended, names, typeset } from "../../lib/words.js";
import { catalogue, stickSlip, stickSlipSentence } from "./stick_slip.js";

export class RecordingCard {
  constructor(page, known, state, { changed, removed }) {
    Object.assign(this, { page, known, changed, removed });
    this.state = { key: state.key ?? null, name: state.name || "" };
    this.state.source = { columns: {}, units: {}, channels: {}, ...(state.source || {}) };
    this.state.options = { ...(state.options || {}) };
    this.result = null;
    this.recording = null;
    this.left = new Set(state.left || []); // rows that a fit leaves out
    this.fitted = state.fitted !== false;
    this.task = new Task(`Progress of ${this.state.name}`, { onRefused: (why) => this.#refused(why) });
    this.body = el("div", { class: "card-body" });
    this.forms = el("div", { class: "card-forms" });
    this.element = el("article", { class: "recording", tabindex: "-1", "aria-label": this.state.name },
      el("header", {}, el("h3", {}, this.state.name),
        el("button", { type: "button", class: "quiet", "aria-label": `Remove ${this.state.name}`, click: () => this.remove() }, "Remove")),
      this.task.status, this.task.bar, this.task.message, this.forms, this.body);
  }

  /** What a link holds: see `RecordingCard.restored`. */
  saved() {
    const { key, name, source, options } = this.state;
    return [key, name, source, options, [...this.left], this.fitted];
  }

  static restored(text) {
    const [key, name, source, options, left, fitted] = JSON.parse(text);
    return { key, name: String(name), source, options, left, fitted };
  }

  renamed() {
    // Tables are worded by the server.
    if (this.result?.measured) this.measure();
  }

  rows() {
    const rows = this.result?.measured?.rows || [];
    return rows.filter((row, i) => row.kind === "amplitude" && !row.reason && !this.left.has(i));
  }

  /** The whole recording for a fit; null for one with a modulated load. */
  run() {
    const { key, name, source, options } = this.state;
    if (this.result?.measured?.record.mode !== "sliding" || !this.fitted) return null;
    const { record, curves } = this.result.measured;
    this.traced ||= { curve: curves.friction, segments: record.segments, level: record.friction.value, load: record.load?.value ?? 1 };
    return {
      recording: this.traced,
      question: { recording: key, source, window: options.window || null, steps: options.steps || null, velocities: options.velocities || null },
    };
  }

  table() {
    const sent = this.result?.table;
    return sent ? { name: sent.name, text: sent.text } : null;
  }

  remove() {
    this.task.stop();
    this.removed();
  }

  async send(file) {
    this.task.begin("Sending…");
    const sent = await this.task.work.send("data/upload", file, (share) => { this.task.bar.value = share; });
    if (!sent) return;
    this.state.key = sent.id;
    await this.measure();
  }

  async measure() {
    this.task.begin("");
    this.#says("Reading…");
    const { source } = this.state;
    const { mode, ...options } = this.state.options;
    if (mode === "stick-slip") options.stick_slip = true;
    else if (mode && mode !== "auto") options.modulated = mode === "modulated";
    if (options.harmonics) options.harmonics = written(options.harmonics);
    const result = await this.task.run("data/measure", { recording: this.state.key, source, options, names: names() }, (part) => {
      if (part.waiting) this.#says("Waiting for another recording…");
      if (part.stage === "measuring") this.#says("Measuring…");
      if (part.recording) { this.recording = part.recording; this.#drawForms(); }
    });
    if (!result) return;
    this.result = result;
    this.traced = null;
    this.task.stop();
    this.#draw();
    this.changed();
  }

  #refused(why) {
    this.result = null;
    fill(this.body);
    this.task.end("", why);
    this.#says("Not measured.", "bad");
    if (this.state.key) this.#drawForms();
    this.changed();
  }

  #says(text, state = "") {
    this.task.status.dataset.state = state;
    this.task.status.textContent = text;
  }

  // --- Corrections -----------------------------------------------------------------------------

  #drawForms() {
    const { source, options } = this.state;
    const { labels } = this.page.catalogue;
    const open = this.forms.querySelector("details")?.open;
    const again = () => { this.left.clear(); this.measure(); };
    const set = (object, key) => (value) => {
      if (value) object[key] = value; else delete object[key];
      again();
    };
    // The server reads the texts, and says what is wrong with them.
    const text = (object, key, placeholder, unit = "") =>
      textField((labels[`measure.${key}`] || labels[key]) + unit, object[key], set(object, key), placeholder);
    const texts = (key, placeholder, unit = "") => textField(labels[key] + unit, options[key]?.join(", "), (value) => {
      const parts = value.split(/[,;]/).map((part) => part.trim()).filter(Boolean);
      set(options, key)(parts.length ? parts : null);
    }, placeholder);
    const flag = (key) => tick(labels[key], Boolean(options[key]), set(options, key));
    const { recording } = this;
    const channels = recording ? [this.#channelTable(recording, again)] : [];
    const mode = options.mode || "auto";
    fill(this.forms, el("details", { open: Boolean(open || !this.recording || this.task.message.textContent) },
      el("summary", {}, "Channels, units and options"),
      ...channels,
      el("form", { class: "filters", submit: (e) => e.preventDefault() },
        choice("What it is", [["auto", "recognised by the program"], ["modulated", "a modulated load"], ["sliding", "velocity steps and holds"], ["stick-slip", "stick-slip"]],
          mode, set(options, "mode")),
        text(options, "frequency", "measured, or 120 Hz"),
        flag("exact_frequency"),
        text(options, "harmonics", "4"),
        text(options, "window", "chosen, or 10:60", " (s)"),
        flag("whole_periods"),
        choice(labels.detrend, ["none", "linear", "quadratic"].map((n) => [n, n]), options.detrend || "linear", set(options, "detrend")),
        texts("steps", "detected, or 12.5, 60", " (s)"),
        texts("velocities", "measured, or 1 um/s, 10 um/s"),
        texts("holds", "detected, or 100:110", " (s)"),
        text(options, "stiffness", "for slips and energies, 168 N/m"),
        text(options, "velocity", "of stick-slip, 42 um/s"),
        text(options, "mass", "of stick-slip, 30.7 g"),
        text(options, "normal_load", "M g, or 3 N"),
        text(source.columns, "time", "named in the file, or column 0"),
        text(source, "rate", "from the file, or 10 kHz"),
        text(source, "area", "turns stress into force, 25 cm^2"),
        text(source, "group", "of HDF5, MATLAB, TDMS"),
        text(source, "format", "recognised, or text"),
        text(source, "delimiter", "detected"),
        text(source, "decimal", "detected"),
        textField("Derived channels", Object.entries(source.channels).map(([n, e]) => `${n} = ${e}`).join("; "), (v) => {
          source.channels = Object.fromEntries(v.split(";").filter((part) => part.trim()).map((part) => {
            const [made, ...formula] = part.split("=");
            return [made.trim(), formula.join("=").trim()];
          }));
          again();
        }, "load = A - B"))));
  }

  #channelTable(recording, again) {
    const { source } = this.state;
    const roleOf = (name) => Object.entries({ ...recording.roles }).find(([, n]) => n === name)?.[0] || "";
    const shown = (channel, value) => (value === undefined ? "–" : channel.kind ? quantity(value, channel.kind, 3) : digits(value, 3));
    const rows = recording.channels.map((channel) => {
      const role = el("select", {
        "aria-label": `Role of ${channel.name}`,
        change: () => {
          for (const [r, n] of Object.entries(source.columns)) if (n === channel.name) delete source.columns[r];
          if (role.value) source.columns[role.value] = channel.name;
          again();
        },
      }, [["", "–"], ...Object.entries(this.known.roles)].map(([v, t]) => el("option", { value: v }, t)));
      role.value = roleOf(channel.name);
      const unit = el("input", {
        type: "text", class: "unit", "aria-label": `Unit of ${channel.name}`, placeholder: channel.recorded_unit || "unit",
        change: () => {
          if (unit.value.trim()) source.units[channel.name] = unit.value.trim(); else delete source.units[channel.name];
          again();
        },
      });
      unit.value = source.units[channel.name] || "";
      return el("tr", {},
        el("th", { scope: "row" }, channel.name), el("td", {}, role), el("td", {}, unit),
        el("td", {}, channel.kind === null ? "unknown" : channel.unit || "pure number"),
        el("td", {}, `${shown(channel, channel.least)} to ${shown(channel, channel.largest)}`),
        el("td", {}, channel.curve ? sparkline(channel.curve) : ""));
    });
    const rate = recording.rate ? `${digits(recording.rate, 6)} Hz` : "uneven sampling";
    return scrolling(`Channels of ${this.state.name} as understood`, [
      el("p", { class: "note" }, `${recording.samples.toLocaleString("en")} samples, ${digits(recording.start, 6)} s to ${digits(recording.end, 6)} s, ${rate}; ${recording.provenance.format || ""}`),
      el("table", {}, el("thead", {}, el("tr", {}, ["Channel", "Role", "Unit", "Understood", "Values", "Curve"].map((t) => el("th", { scope: "col" }, t)))),
        el("tbody", {}, rows))]);
  }

  // --- Results ---------------------------------------------------------------------------------

  #draw() {
    if (this.result.table) {
      this.#drawTable();
      return;
    }
    const { measured } = this.result;
    const { record } = measured;
    this.#says(this.#sentence(record, measured.note), record.verdict === "ok" ? "stable" : "unstable");
    fill(this.body,
      el("div", { class: "actions" },
        copies(["Copy as Python", () => this.result.python], ["Copy as command", () => this.result.command]),
        el("button", { type: "button", click: () => saveFile(`${this.state.name}.json`, JSON.stringify(record, null, 2), "application/json") }, "JSON"),
        el("button", { type: "button", click: () => saveRows(`${this.state.name}-rows.csv`, measured.rows) }, "CSV")),
      record.mode === "sliding" && tick("Fit the whole recording", this.fitted, (on) => { this.fitted = on; this.changed(); },
        "The fit below uses it, with the window, the velocity steps and the velocities above"),
      measured.amplitudes && this.#amplitudes(measured),
      el("div", { class: "panels" }, this.#figures(measured).map((f) => f.element)),
      ...sections(measured.sections, ` of ${this.state.name}`),
      record.mode === "stick-slip" && catalogue(record, this.state.name),
      this.#findings());
  }

  #sentence(record, note) {
    const named = (verdict) => [...new Set(record.checks.filter((c) => c.verdict === verdict).map((c) => c.name))];
    const [bad, doubtful] = [named("bad"), named("suspicious")];
    const verdict = bad.length ? `bad: ${bad.join(", ")}` : doubtful.length ? `doubtful: ${doubtful.join(", ")}` : "all checks are good";
    const what = record.mode === "stick-slip" ? stickSlipSentence(record) : record.mode === "modulated"
      ? `Modulated at ${digits(record.frequency, 6)} Hz by ${digits(100 * record.epsilon, 3)} %`
      : `No modulation: ${count(record.steps.length, "velocity step")}, ${count(record.holds.length, "hold")}`;
    return `${what}; ${verdict}.${note && record.mode === "sliding" && this.state.options.mode === "sliding" ? ` ${note}` : ""}`;
  }

  #figures(measured) {
    if (measured.record.mode === "modulated") return this.#modulated(measured);
    if (measured.record.mode === "sliding") return this.#sliding(measured);
    const whole = this.#figure("whole", "The recording with its slip events", measured.curves.friction, ["time", "F/W"]);
    return stickSlip(measured, whole);
  }

  #modulated({ record, curves }) {
    const whole = this.#figure("whole", "The recording", curves.force, ["time", "force over W0"]);
    const cycle = this.#figure("cycle", "Mean cycle", { x: curves.cycle.phase, y: curves.cycle.measured }, ["phase", "friction less mean"]);
    const spectrum = this.#figure("spectrum", "Spectrum of the residual", curves.spectrum, ["frequency", "amplitude"]);
    const amplitudes = record.harmonics.map(([a, b]) => Math.hypot(a, b));
    const bars = this.#figure("harmonics", "Harmonics", { x: amplitudes.map((_, i) => i + 1), y: amplitudes }, ["harmonic", "amplitude"]);
    const { start, end } = record.window;
    const order = amplitudes.map((_, i) => i + 1);
    whole.draw({ x: { label: "time (s)" }, rows: [
      { y: { label: "W/W₀" }, marks: [start, end], lines: [{ ...curves.load, cls: series(5), name: "load" }] },
      { y: { label: "F/W₀" }, marks: [start, end], lines: [{ ...curves.force, cls: series(0), name: "force" }] },
    ] }, `Load and force; read from ${digits(start, 6)} s to ${digits(end, 6)} s.`);
    cycle.draw({ x: { label: "phase of the load / 2π", range: [0, 1] }, rows: [{
      y: { label: "F/W₀ − mean" },
      lines: [{ x: curves.cycle.fine_phase, y: curves.cycle.fitted, cls: series(1), name: "harmonics", thick: true }],
      points: [{ x: curves.cycle.phase, y: curves.cycle.measured, cls: series(0), size: 3 }],
    }] }, "Mean cycle with the fitted harmonics.");
    bars.draw({ x: { label: "harmonic n", range: [0.4, amplitudes.length + 0.6], ticks: order }, rows: [{
      y: { label: "μₙ", log: true, range: [Math.min(...amplitudes.filter((v) => v > 0)) / 3, 2 * Math.max(...amplitudes)] },
      bars: [{ x: order, y: amplitudes, cls: series(0), title: (i) => `μ${i + 1} = ${digits(amplitudes[i])} ± ${digits(record.uncertainties[`mu${i + 1}`], 2)}` }],
    }] }, amplitudes.map((v, i) => `μ${i + 1} ${digits(v, 3)}`).join(", "));
    spectrum.draw({ x: { label: "frequency (Hz)" }, rows: [{
      y: { label: "amplitude of F/W₀", log: true },
      lines: [{ ...curves.spectrum, cls: series(5), name: "residual" }],
      points: [{ x: order.map((n) => n * record.frequency), y: amplitudes, cls: series(1), title: (i) => `μ${i + 1} = ${digits(amplitudes[i])}` }],
    }] }, "Spectrum of the residual, and the harmonics as points.");
    return [whole, cycle, bars, spectrum];
  }

  #sliding({ record, curves }) {
    const whole = this.#figure("whole", "Friction, segments, steps and holds", curves.friction, ["time", "friction"]);
    const levels = record.segments.filter((s) => !s.hold).flatMap((s) => {
      // The steady level with its drift, and what both are at the beginning of the segment.
      const at = (t) => s.steady.value + (s.slope ?? 0) * (t - (s.steady.start + s.end) / 2);
      const line = (from, to, style) => ({ x: [from, to], y: [at(from), at(to)], cls: series(1), name: `steady level and drift at ${quantity(s.velocity ?? 0, "velocity", 3)}`, ...style });
      return [line(s.start, s.steady.start, { dashed: true }), line(s.steady.start, s.end, { thick: true })];
    });
    whole.draw({ x: { label: "time (s)" }, rows: [{
      y: { label: "friction F/W" }, marks: record.segments.slice(1).map((s) => s.start),
      lines: [{ ...curves.friction, cls: series(5), name: "friction" }, ...levels],
      points: [{ x: record.holds.map((h) => h.peak_time), y: record.holds.map((h) => h.peak), cls: series(0), title: (i) => `peak after ${digits(record.holds[i].hold_time, 3)} s: ${digits(record.holds[i].peak, 4)}` }],
    }] }, `Friction over time: ${count(record.steps.length, "step")}, ${count(record.holds.length, "hold")}.`);
    const figures = [whole];
    const dots = (figure, x, label, at, values, doubts, description) => {
      figures.push(figure);
      const range = [Math.min(...at) / 1.6, Math.max(...at) * 1.6];
      figure.draw({ x: { ...x, log: true, range }, rows: [{ y: { label }, ...errorBars(at, values, doubts) }] }, description);
    };
    if (record.steps.length) {
      const [after, rates] = ["velocity_after", "rate_dependence"].map((n) => record.steps.map((s) => s[n]));
      dots(this.#figure("rates", "Rate dependence A − B", { x: after, y: rates }, ["velocity after", "rate dependence"]),
        { label: "velocity after the step", format: (v) => quantity(v, "velocity", 3) }, "A − B",
        after.map(Math.abs), rates, record.steps.map((s) => s.rate_uncertainty), "A − B of each velocity step.");
    }
    if (record.holds.length) {
      const [held, healing] = ["hold_time", "healing"].map((n) => record.holds.map((h) => h[n]));
      dots(this.#figure("healing", "Healing after holds", { x: held, y: healing }, ["hold time", "healing"]),
        { label: "hold time (s)" }, "healing",
        held, healing, record.holds.map((h) => h.healing_uncertainty), "Healing against the time of each hold.");
    }
    return figures;
  }

  #figure(kind, title, curve, [x, y]) {
    const columns = () => ({ [x]: curve.x, [y]: curve.y });
    if (kind !== "whole") return new Figure({ name: kind, title, height: 260, columns });
    const { window } = this.state.options;
    const measure = (part) => {
      this.left.clear();
      if (part) this.state.options.window = part; else delete this.state.options.window;
      this.measure();
    };
    return new Figure({
      name: kind, title, height: 360, columns, onSpan: (from, to) => measure(`${from}:${to}`),
      options: window && el("button", { type: "button", class: "small", click: () => measure(null) }, "Measure the whole recording"),
      caption: "Drag over a part of the trace with the mouse to measure that part only.",
    });
  }

  /** The modulated parts, each of which can be left out of a fit. */
  #amplitudes({ rows, amplitudes: [parts, notes] }) {
    const boxed = parts.rows.map(([part, ...cells]) => {
      const i = rows.findIndex((row) => String(row.part) === part);
      const box = el("input", {
        type: "checkbox", "aria-label": `Use part ${part} in fits`, change: () => { if (box.checked) this.left.delete(i); else this.left.add(i); this.changed(); },
      });
      box.checked = !this.left.has(i);
      return [part, box, ...cells.map(typeset)];
    });
    const [first, ...others] = parts.head;
    return el("div", {}, table([first, "in fits", ...others], boxed, `What was measured of ${this.state.name}`), ...sections([notes]));
  }

  #findings() {
    const findings = this.recording?.findings || [];
    if (!findings.length) return null;
    return el("details", {}, el("summary", {}, `${count(findings.length, "finding")} in the file`),
      el("ul", { class: "checks" }, findings.map((f) => el("li", { class: f.severity }, el("span", { class: "badge" }, f.severity), el("b", {}, f.name), ` ${ended(f.sentence)}`))));
  }

  #drawTable() {
    const sent = this.result.table;
    this.#says(sent.json ? "A lock-in reading." : `A lock-in table of ${count(sent.count, "row")}.`, "stable");
    fill(this.forms);
    fill(this.body, sent.json ? [] : table(sent.header, sent.rows, sent.name, true));
  }
}

function errorBars(x, y, doubt) {
  return {
    lines: x.map((at, i) => ({ x: [at, at], y: [y[i] - 2 * (doubt[i] ?? 0), y[i] + 2 * (doubt[i] ?? 0)], cls: series(0) })),
    points: [{ x, y, cls: series(0), title: (i) => `${withDoubt(y[i], doubt[i])} at ${digits(x[i], 3)}` }],
  };
}

function sparkline({ x, y }) {
  const known = y.map((v, i) => [x[i], v]).filter(([, v]) => v !== null);
  if (known.length < 2) return "";
  const [low, high] = [Math.min(...known.map((k) => k[1])), Math.max(...known.map((k) => k[1]))];
  const [first, last] = [known[0][0], known.at(-1)[0]];
  const path = known.map(([t, v], i) => `${i ? "L" : "M"}${(120 * (t - first) / (last - first || 1)).toFixed(1)} ${(23 - 22 * (v - low) / (high - low || 1)).toFixed(1)}`).join("");
  const holder = el("span", { class: "spark" });
  holder.innerHTML = `<svg width="120" height="24" viewBox="0 0 120 24" aria-hidden="true"><path d="${path}"/></svg>`;
  return holder;
}

