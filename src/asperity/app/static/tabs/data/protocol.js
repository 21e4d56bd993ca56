// The virtual tribometer: a protocol that is checked while it is written, run, and recorded.

import { Figure, series } from "../../lib/charts.js";
import { choice } from "../../lib/controls.js";
import { el, fill, fresh } from "../../lib/dom.js";
import { copies } from "../../lib/save.js";
import { Work } from "../../lib/server.js";
import { Task } from "../../lib/task.js";
import { digits } from "../../lib/units.js";
import { capital } from "../../lib/words.js";

/** Time (ms) without a key after which the text is checked. */
const REST = 350;
/** Longest text (characters) that a link holds. */
const LONGEST = 4000;
const PYTHON = 'from asperity.protocol import load_protocol, record_run, run_protocol\n\nprotocol = load_protocol("protocol.toml")\nrun_protocol(protocol, "run.nc")\nif protocol.setup is not None:\n    trace = record_run(protocol.setup, "run.nc")\n    print(trace)\n';

export class ProtocolPanel {
  constructor(page, { read, changed }) {
    Object.assign(this, { page, read, changed });
    const id = fresh("protocol");
    this.text = el("textarea", {
      id, rows: 22, spellcheck: "false", autocomplete: "off", autocapitalize: "off", class: "code",
      "aria-describedby": `${id}-mistakes`,
      input: () => { this.#checkLater(); this.changed(); },
    });
    this.mistakes = el("div", { class: "mistakes", id: `${id}-mistakes`, role: "status" });
    this.task = new Task("Progress of the run");
    this.result = el("div", { class: "card-body" });
    this.runButton = el("button", { type: "button", class: "primary", click: () => this.start() }, "Run");
    this.checking = new Work((sentence) => this.#checked({ mistakes: [{ sentence, line: null }] }));
    this.chooser = el("div");
    this.figure = new Figure({
      name: "motion", title: "The motion", height: 420,
      columns: () => ({ time: this.shown.curves.load.x, load: this.shown.curves.load.y, force: this.shown.curves.force.y, velocity: this.shown.curves.velocity.y }),
    });
    this.details = el("details", { class: "recording virtual" },
      el("summary", {}, el("h3", {}, "Virtual tribometer")),
      el("p", { class: "note" }, "A protocol in TOML, as for asperity run: what slides, how it begins, the steps, and what records them."),
      this.chooser,
      el("div", { class: "choice" }, el("label", { for: id }, "Protocol"), this.text), this.mistakes,
      el("div", { class: "actions" }, this.runButton, this.task.cancel,
        copies(["Copy as Python", () => PYTHON], ["Copy as command", () => "asperity run protocol.toml --out run.nc --record recording.csv"])),
      this.task.status, this.task.bar, this.task.message, this.result);
    this.details.addEventListener("toggle", () => { if (this.protocols && this.details.open) { this.#check(); this.changed(); } });
    this.element = this.details;
  }

  begin(protocols) {
    this.protocols = protocols;
    this.name = protocols.modulation ? "modulation" : Object.keys(protocols)[0];
    this.text.value = protocols[this.name];
    this.#chooser();
  }

  #chooser() {
    fill(this.chooser, choice("Begin with", Object.keys(this.protocols).map((n) => [n, n.replaceAll("_", " ")]), this.name, (n) => {
      this.name = n;
      this.text.value = this.protocols[n];
      this.#check();
      this.changed();
    }));
  }

  save(parameters) {
    if (!this.protocols || !this.details.open) return;
    parameters.set("run", this.name);
    if (this.text.value !== this.protocols[this.name] && this.text.value.length < LONGEST) parameters.set("protocol", this.text.value);
  }

  restore(parameters) {
    const chosen = parameters.get("run");
    if (chosen in this.protocols) this.name = chosen;
    this.text.value = parameters.get("protocol") || this.protocols[this.name];
    this.#chooser();
    this.details.open = parameters.has("run");
  }

  #checkLater() {
    clearTimeout(this.resting);
    this.resting = setTimeout(() => this.#check(), REST);
  }

  async #check() {
    clearTimeout(this.resting);
    const result = await this.checking.run("data/protocol", { text: this.text.value });
    if (result) this.#checked(result);
  }

  #checked({ mistakes, duration, rows, steps, records }) {
    this.text.setAttribute("aria-invalid", String(mistakes.length > 0));
    fill(this.mistakes, mistakes.length
      ? mistakes.map(({ sentence, line }) => el("p", {}, line
        ? el("button", { type: "button", class: "quiet small", click: () => this.#goTo(line) }, `line ${line}`) : "", ` ${capital(sentence)}`))
      : el("p", { class: "fine" }, `${steps} steps, ${digits(duration, 4)} s${rows ? `, ${Math.round(rows).toLocaleString("en")} rows` : ""}; ${records ? "recorded by its tribometer" : "without a tribometer: the motion itself is read"}.`));
  }

  #goTo(line) {
    const lines = this.text.value.split("\n");
    const start = lines.slice(0, line - 1).join("\n").length + (line > 1 ? 1 : 0);
    this.text.focus();
    this.text.setSelectionRange(start, start + lines[line - 1].length);
    this.text.scrollTop = Math.max(0, (line - 5) * parseFloat(getComputedStyle(this.text).lineHeight));
  }

  async start() {
    const { status, bar } = this.task;
    fill(this.result);
    this.task.begin("Preparing…");
    const result = await this.task.run("data/run", { text: this.text.value }, (part) => {
      if (part.waiting) status.textContent = "Waiting for another run…";
      if (part.reached !== undefined) {
        bar.value = part.reached / part.duration;
        status.textContent = `${digits(part.reached, 3)} s of ${digits(part.duration, 3)} s`;
      }
    });
    if (result) this.#draw(result);
  }

  #draw(result) {
    this.shown = result;
    this.task.end(result.stopped ? capital(result.stopped) : `Done: ${result.rows.toLocaleString("en")} rows.`);
    fill(this.result,
      result.stability && el("p", { class: "note" }, capital(result.stability)),
      el("div", { class: "actions" }, el("button", { type: "button", class: "primary", click: () => this.read({ id: result.id, name: result.name }) }, "Read this recording")),
      this.figure.element);
    const { load, force, velocity } = result.curves;
    this.figure.draw({
      x: { label: "time (s)" },
      rows: [["load (N)", load, 5], ["force (N)", force, 0], ["velocity (m/s)", velocity, 1]]
        .map(([label, curve, k]) => ({ y: { label }, lines: [{ ...curve, cls: series(k), name: label }] })),
    }, "Load, force and slip velocity over the run.");
  }
}
