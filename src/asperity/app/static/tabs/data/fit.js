// A law fitted to what was measured, or several compared.

import { Figure, key, series } from "../../lib/charts.js";
import { choice, textField, tick } from "../../lib/controls.js";
import { el, fill, fresh } from "../../lib/dom.js";
import { copies, saveFile, saveRows } from "../../lib/save.js";
import { sections } from "../../lib/tables.js";
import { Task } from "../../lib/task.js";
import { digits, written } from "../../lib/units.js";
import { capital, ended, nameOf, names as chosenNames } from "../../lib/words.js";
import { ByHand } from "./by_hand.js";

/** What a fit begins with, by the kind of data; without free parameters, all that the data may show. */
const DEFAULTS = {
  tables: { laws: ["elasto-plastic"], material: "bureau2000", free: ["eps_ratio", "lambda"] },
  runs: { laws: ["rice-ruina"], material: "", free: [] },
};
const SETTINGS = {
  ...DEFAULTS.tables, fixed: "",
  prior: false, profile: false, inertia: false, report: false, posterior: false, draws: "1000", chains: "4",
  trend: "linear", drift: false, initial: "steady", gauge: "", fit_rate: "",
};
const LABELS = { mean_friction: "mean F/W₀", delta_mu: "Δμ̄", mu1: "μ₁", mu2: "μ₂" };

export class FitPanel {
  constructor(page, { rows, tables, runs, changed }) {
    Object.assign(this, { page, rows, tables, runs, changed });
    this.settings = { ...SETTINGS };
    this.form = el("form", { class: "fit-form", submit: (e) => { e.preventDefault(); this.start(); } });
    this.data = el("p", { class: "note" });
    this.task = new Task("Progress of the draws", { onEnd: () => { this.fitButton.disabled = false; } });
    this.results = el("div", { class: "card-body" });
    this.byHand = new ByHand(page, (start) => this.start(start), changed);
    this.fitButton = el("button", { type: "button", class: "primary", click: () => this.start() }, "Fit");
    this.element = el("section", { class: "recording fit", "aria-label": "Fit and compare" },
      el("h3", {}, "Fit and compare"), this.data, this.form, this.byHand.element,
      el("div", { class: "actions" }, this.fitButton, this.task.cancel), this.task.status, this.task.bar, this.task.message, this.results);
    this.element.hidden = true;
    this.#build();
  }

  save(parameters) {
    if (!this.element.hidden && JSON.stringify(this.settings) !== JSON.stringify(SETTINGS)) parameters.set("fit", JSON.stringify(this.settings));
    const hand = this.byHand.saved();
    if (hand) parameters.set("hand", hand);
  }

  /** Write parameters by their names in another set of names. */
  renamed() {
    this.#free();
    this.byHand.renamed();
  }

  restore(parameters) {
    this.settings = { ...SETTINGS };
    this.byHand.restore(parameters.get("hand"));
    try {
      const kept = JSON.parse(parameters.get("fit") || "{}");
      const { laws } = this.page.catalogue;
      if (Array.isArray(kept.laws)) this.settings.laws = kept.laws.filter((n) => laws[n]?.rate_dependent);
      if (Array.isArray(kept.free)) this.settings.free = kept.free.filter((n) => typeof n === "string");
      for (const [n, usual] of Object.entries(SETTINGS)) {
        if (!Array.isArray(usual) && typeof kept[n] === typeof usual) this.settings[n] = kept[n];
      }
    } catch {
      // A link that was cut: the default settings.
    }
    this.#build();
  }

  refresh() {
    const rows = this.rows().length;
    const tables = this.tables().length;
    const runs = this.runs().length;
    this.element.hidden = !(rows || tables || runs);
    this.runOptions.hidden = !runs;
    this.#begin(runs && !rows && !tables ? "runs" : "tables");
    const parts = [rows && `${rows} measured ${rows === 1 ? "amplitude" : "amplitudes"}`, tables && `${tables} ${tables === 1 ? "table" : "tables"}`, runs && `${runs} whole ${runs === 1 ? "recording" : "recordings"}`].filter(Boolean);
    this.#hand();
    this.data.textContent = `Data: ${parts.join(" and ")}.`;
  }

  #hand() {
    const runs = this.runs();
    this.byHand.use(runs.length === 1 ? runs[0].recording : null, this.settings.laws[0]);
  }

  /** The defaults of another kind of data, unless a setting was changed. */
  #begin(kind) {
    const before = DEFAULTS[this.kind || "tables"];
    const untouched = Object.keys(before).every((n) => JSON.stringify(this.settings[n]) === JSON.stringify(before[n]));
    if (kind !== (this.kind || "tables") && untouched) {
      Object.assign(this.settings, structuredClone(DEFAULTS[kind]));
      this.#build();
    }
    this.kind = kind;
  }

  #build() {
    const { laws, materials, labels } = this.page.catalogue;
    const { settings } = this;
    const names = Object.keys(laws).filter((n) => laws[n].rate_dependent);
    const set = (key) => (value) => { settings[key] = value; this.changed(); };
    const toggle = (key, n, order) => (on) => {
      settings[key] = order.filter((m) => (m === n ? on : settings[key].includes(m)));
      this.#free();
      if (settings.laws.length) this.#hand();
      this.fitButton.textContent = settings.laws.length > 1 ? "Compare" : "Fit";
      this.changed();
    };
    const id = fresh("fixed");
    const fixed = el("textarea", { id, rows: 3, spellcheck: "false", placeholder: "V = 10 um/s", input: () => set("fixed")(fixed.value) });
    fixed.value = settings.fixed;
    this.freeHolder = el("div", { class: "ticks" });
    const text = (key, placeholder) => textField(labels[key], settings[key], set(key), placeholder);
    const flag = (key, explanation) => tick(labels[key], settings[key], set(key), explanation);
    this.sampling = el("div", { class: "filters" }, text("draws", "1000"), text("chains", "4"));
    this.sampling.hidden = !settings.posterior;
    this.runOptions = el("fieldset", {}, el("legend", {}, "Whole recordings"),
      el("p", { class: "note" }, "The law's motion over the whole recording is fitted; K is free for each recording, and the noise is estimated."),
      el("div", { class: "filters" },
        choice(labels.trend, ["none", "linear", "quadratic"].map((n) => [n, n]), settings.trend, set("trend")),
        choice(labels.initial, [["steady", "steady sliding"], ["free", "free"]], settings.initial, set("initial")),
        text("gauge", "none, or 50 Hz"),
        text("fit_rate", "chosen, or 100 Hz, or full"),
        flag("drift")));
    fill(this.form,
      el("fieldset", {}, el("legend", {}, `${labels.laws}: tick one to fit it, several to compare them`),
        el("div", { class: "ticks" }, names.map((n) => tick(n, settings.laws.includes(n), toggle("laws", n, names), laws[n].title)))),
      el("fieldset", {}, el("legend", {}, `${labels.free}; if none is ticked, all that the data can determine`), this.freeHolder),
      el("div", { class: "fit-more" },
        choice("Other numbers from", [["", "no material"], ...Object.keys(materials).map((n) => [n, n])], settings.material, set("material")),
        el("div", { class: "choice" }, el("label", { for: id }, `${labels.fixed}, one per line; V is the pulling velocity`), fixed),
        el("div", { class: "ticks" },
          flag("prior"),
          flag("profile"),
          tick(labels.posterior, settings.posterior, (on) => { set("posterior")(on); this.sampling.hidden = !on; },
            "As asperity fit --posterior; it takes a minute or more"),
          tick("With the inertia of the slider", settings.inertia, set("inertia")),
          tick("Write the report folder", settings.report, set("report"), "As asperity fit --report and asperity compare --report write it")),
        this.sampling),
      this.runOptions);
    this.runOptions.hidden = !this.runs().length;
    this.#free();
    this.fitButton.textContent = settings.laws.length > 1 ? "Compare" : "Fit";
  }

  #free() {
    const { laws } = this.page.catalogue;
    const parameters = [...new Set(this.settings.laws.flatMap((l) => laws[l].parameters.filter((p) => p.place !== "drive").map((p) => p.name)))];
    const names = ["eps_ratio", ...parameters.filter((n) => !["V0", "inertia", "epsilon", "frequency", "V"].includes(n))];
    fill(this.freeHolder, names.map((n) => tick(nameOf(n), this.settings.free.includes(n), (on) => {
      this.settings.free = names.filter((m) => (m === n ? on : this.settings.free.includes(m)));
      this.changed();
    })));
    this.names = names;
  }

  /** Free parameters, null where none is chosen: all that the data may show are. */
  #freed() {
    const free = this.settings.free.filter((n) => this.names.includes(n));
    return free.length ? free : null;
  }

  /** Fit or compare; `start` has start values by parameter. */
  async start(start = {}) {
    const { settings } = this;
    const { status, bar } = this.task;
    this.task.end("");
    fill(this.results);
    const fixed = {};
    for (const line of settings.fixed.split(/[\n;]+/).filter((l) => l.trim())) {
      const [n, ...value] = line.split("=");
      if (!n.trim() || !value.join("=").trim()) {
        this.task.message.textContent = `Fixed numbers must be NAME = VALUE, got “${line.trim()}”; write it like V = 1 um/s.`;
        return;
      }
      fixed[n.trim()] = value.join("=").trim();
    }
    if (settings.prior && !settings.material) {
      this.task.message.textContent = `${this.page.catalogue.labels.prior} must come from a material, got none; choose it under “Other numbers from”.`;
      return;
    }
    const question = {
      laws: settings.laws, free: this.#freed(),
      rows: this.rows(), tables: this.tables(), fixed, start,
      runs: this.runs().map((r) => r.question),
      // Without a recording these fields are hidden.
      ...(this.runs().length && {
        trend: settings.trend, drift: settings.drift, initial: settings.initial, gauge: settings.gauge || null,
        fit_rate: settings.fit_rate || null,
      }),
      report: settings.report, names: chosenNames(),
      material: settings.material || null, prior: settings.prior ? settings.material : null,
      profile: settings.profile, inertia: settings.inertia,
    };
    if (settings.posterior) Object.assign(question, { posterior: true, draws: written(settings.draws), chains: written(settings.chains) });
    this.task.begin("Fitting…");
    this.fitButton.disabled = true;
    const result = await this.task.run("data/fit", question, (part) => {
      if (part.waiting) status.textContent = "Waiting for another fit…";
      if (part.share !== undefined) {
        bar.value = part.share;
        status.textContent = `Fitting… ${Math.round(100 * part.share)} %.`;
      }
      if (part.draws !== undefined) {
        bar.value = part.draws / part.of;
        status.textContent = part.draws ? `Sampling… ${part.draws} of ${part.of} draws, warm-up included.` : "Sampling: starting the processes…";
      }
      bar.hidden = part.draws === undefined && part.share === undefined;
      if (part.stage === "figures") status.textContent = "Drawing the figures…";
      if (part.stage === "report") status.textContent = "Writing the report folder…";
    });
    if (result) this.#draw(result);
  }

  #draw({ fit, comparison, sections: described, laws, posterior, bands, residuals, runs, report, python, command }) {
    const record = fit || comparison;
    const buttons = el("div", { class: "actions" },
      copies(["Copy as Python", () => python], ["Copy as command", () => command]),
      el("button", { type: "button", click: () => saveFile(fit ? "fit.json" : "comparison.json", JSON.stringify(posterior ? { ...record, posterior } : record, null, 2), "application/json") }, "JSON"),
      report && el("button", { type: "button", click: () => saveFile("report.zip", fromBase64(report)) }, "Report folder (ZIP)"),
      el("button", { type: "button", click: () => this.#saveCsv(fit ? { [fit.law]: fit } : comparison.laws) }, "CSV"));
    if (fit?.converged) this.byHand.take(fit);
    // The first sentence of the report stands next to the button, then the picture, then the numbers.
    const [first, ...others] = described;
    this.task.end(first.sentences.length ? first.sentences.map(ended).join(" ") : capital(first.title));
    const ofLaws = Object.entries(laws || {}).map(([n, ofLaw]) => el("details", { open: n === comparison.best }, el("summary", {}, n), ...sections(ofLaw.map((s) => ({ ...s, title: s.title === n ? "" : s.title })), ` of ${n}`)));
    fill(this.results, ...this.#runs(runs), ...this.#bands(bands), buttons,
      ...sections([{ ...first, sentences: [] }, ...others]), ...ofLaws, ...this.#posterior(posterior), this.#residuals(residuals));
  }

  /** Densities of the draws. */
  #posterior(posterior) {
    if (!posterior) return [];
    const { parameters, histograms } = posterior;
    const shown = Object.entries(histograms).map(([n, { x, y }]) => {
      const p = parameters[n];
      const figure = new Figure({ name: `posterior-${n}`, title: `Posterior of ${n}`, height: 230, columns: () => ({ [n]: x, density: y }) });
      figure.note.textContent = `Dotted: the ends of the 95 % interval. ${priorText(p.prior)}`;
      const [low, high] = [x[0], x.at(-1)];
      figure.draw({
        x: { label: p.unit ? `${n} (${p.unit})` : n, range: [Math.min(low, p.interval_95[0]), Math.max(high, p.interval_95[1])] },
        rows: [{ y: { label: "density", range: [0, 1.05 * Math.max(...y)] }, marks: p.interval_95, bars: [{ x, y, cls: series(0), title: (i) => `${n} about ${digits(x[i], 4)}` }] }],
      }, `Posterior of ${n}: mean ${digits(p.mean, 4)}, standard deviation ${digits(p.sd, 2)}.`);
      return figure.element;
    });
    return [el("div", { class: "panels" }, shown)];
  }

  /** Readings with their uncertainties, and what the law predicts between them. */
  #bands(bands) {
    return (bands || []).map(({ rows }, k) => {
      const columns = () => {
        const all = rows.flatMap(({ name, series: curves }) => curves.flatMap((v) => v.epsilon.map((e, i) => [name, v.label, e, v.low[i], v.middle[i], v.high[i]])));
        return Object.fromEntries(["observable", "series", "epsilon", "low", "middle", "high"].map((n, j) => [n, all.map((r) => r[j])]));
      };
      const figure = new Figure({ name: `bands-${k + 1}`, title: "Readings and the fitted law", height: Math.max(260, 190 * rows.length), columns });
      const many = rows[0].series.length;
      fill(figure.note,
        rows[0].series.slice(0, 12).map(({ label }, i) => key(series(i), label)),
        many > 12 && el("p", {}, `and ${many - 12} more series`),
        el("p", {}, "Points: readings with two standard errors. Lines: the law, with its 95 % band between the thin ones."));
      figure.draw({
        x: { label: "ε as applied" },
        rows: rows.map(({ name, series: curves }) => ({
          y: { label: LABELS[name] || name },
          lines: curves.flatMap((v, i) => [
            ...["low", "high"].map((end) => ({ x: v.epsilon, y: v[end], cls: series(i), name: `${name}, ${v.label}, ${end} end of the band` })),
            { x: v.epsilon, y: v.middle, cls: series(i), thick: true, name: `${name}, ${v.label}, fitted` },
            ...v.at.map((e, j) => ({ x: [e, e], y: [v.value[j] - 2 * v.error[j], v.value[j] + 2 * v.error[j]], cls: series(i), name: "two standard errors" })),
          ]),
          points: curves.map((v, i) => ({ x: v.at, y: v.value, cls: series(i), size: 4, title: (j) => `${name} ${digits(v.value[j])} ± ${digits(v.error[j], 2)} at ε ${digits(v.at[j], 3)}` })),
        })),
      }, "Readings and what the fitted law predicts between them.");
      return figure.element;
    });
  }

  /** Recordings as fitted: whole, and each transient enlarged. */
  #runs(runs) {
    return (runs || []).map(({ name, recorded, fitted, difference, transients }, k) => {
      const figure = new Figure({ name: `run-${k + 1}`, title: `${name}: recorded and fitted`, height: 330, columns: () => ({ time: recorded.x, friction: recorded.y, time_of_fitted: fitted.x, fitted: fitted.y }) });
      fill(figure.note, key("s6", "recorded"), key("s2", "fitted"));
      const both = (of) => [{ ...of.recorded, cls: "s6", name: "recorded" }, { ...of.fitted, cls: "s2", name: "fitted", thick: true }];
      figure.draw({ x: { label: "time (s)" }, rows: [
        { y: { label: "F/W" }, marks: transients.map((t) => t.time), lines: both({ recorded, fitted }) },
        { y: { label: "recorded − fitted" }, lines: [{ ...difference, cls: "s6", name: "recorded − fitted" }] },
      ] }, `Friction of ${name} as recorded and as fitted.`);
      const enlarged = transients.map((transient) => {
        const title = `After ${digits(transient.time, 6)} s`;
        const near = new Figure({ name: "transient", title, height: 250, columns: () => ({ time: transient.recorded.x, friction: transient.recorded.y }) });
        near.draw({ x: { label: "time (s)" }, rows: [{ y: { label: "F/W" }, marks: [transient.time], lines: both(transient) }] }, `Recorded and fitted friction ${title.toLowerCase()}.`);
        return near.element;
      });
      return el("div", { class: "panels" }, figure.element, enlarged);
    });
  }

  #residuals(residuals) {
    if (!residuals?.value.length) return null;
    const { value, observable } = residuals;
    const names = [...new Set(observable)];
    const figure = new Figure({ name: "residuals", title: "Residuals in standard deviations", height: 230, columns: () => ({ observable, residual: value }) });
    fill(figure.note, names.map((n, k) => key(`point ${series(k)}`, n)));
    const at = value.map((_, i) => i + 1);
    const of = (n) => at.filter((_, i) => observable[i] === n);
    const far = 1.1 * Math.max(3, ...value.map(Math.abs));
    figure.draw({ x: { label: "datum", range: [0, value.length + 1] }, rows: [{
      y: { label: "data − law", range: [-far, far] },
      lines: [{ x: [0, value.length + 1], y: [0, 0], cls: "ink", name: "zero" }],
      points: names.map((n, k) => ({ x: of(n), y: value.filter((_, i) => observable[i] === n), cls: series(k), title: (i) => `${n}: ${digits(value.filter((_, j) => observable[j] === n)[i], 3)}` })),
    }] }, `Residuals of ${names.join(", ")}.`);
    return figure.element;
  }

  #saveCsv(fits) {
    const rows = Object.entries(fits).flatMap(([law, f]) => Object.entries(f.parameters).map(([n, p]) => ({ law, parameter: n, value: p.value, se: p.se, low_95: p.interval_95[0], high_95: p.interval_95[1], unit: p.unit })));
    saveRows("parameters.csv", rows);
  }
}

function fromBase64(text) {
  return new Blob([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], { type: "application/zip" });
}

function priorText({ kind, ...numbers }) {
  const shown = Object.entries(numbers).filter(([, v]) => typeof v === "number").map(([n, v]) => `${n} ${digits(v, 3)}`);
  return `Prior: ${kind}${shown.length ? `, ${shown.join(", ")}` : ""}.`;
}
