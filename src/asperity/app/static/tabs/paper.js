// Paper: figures of a published paper that follow sliders, and the ledger of its claims.

import { Figure, key, series } from "../lib/charts.js";
import { choice, Dock, group, Quantity } from "../lib/controls.js";
import { el, fill, fresh } from "../lib/dom.js";
import { copies, copyLink, saveRows } from "../lib/save.js";
import { Latest, Work } from "../lib/server.js";
import { table } from "../lib/tables.js";
import { Task } from "../lib/task.js";
import { digits, quantity, written } from "../lib/units.js";
import { elementDrawing } from "./paper/element.js";

export const name = "paper";
export const title = "Paper";

const VERDICTS = ["reproduced", "misprint", "differs", "undecided"];
/** Time (ms) without a change after which curves with the mass of the slider are computed. */
const REST = 200;
const KINDS = ["test", "fit", "arithmetic", "identity"];

export function create(page) {
  const view = { paper: "", show: "figures", figure: "", numbers: {}, status: "", kind: "", section: "", search: "" };
  let paper = null;
  let answer = null;
  let verdicts = null;
  let inertia = [];
  let resting = 0;

  const latest = new Latest("paper/figure", answered, refused);
  const opening = new Work(refused);
  const weighing = new Task("Progress of the curves with the mass of the slider", { statusClass: "status", onEnd: () => clearTimeout(resting) });
  const judging = new Work((why) => { ledgerMessage.textContent = why; });
  const message = el("p", { class: "message", role: "alert" });
  const controls = el("form", { class: "controls", "aria-label": "Figure and numbers", submit: (e) => e.preventDefault() });
  const sentence = el("p", { class: "sentence", role: "status" });
  const ends = el("div", {});
  const figure = new Figure({ name: "paper-figure", title: "Figure", height: 460, columns: figureColumns });
  const drawing = el("div", { class: "element" });
  const buttons = el("div", { class: "actions" }, copies(copyLink, ["Copy as Python", () => answer?.python], ["Copy as command", () => answer?.command]));
  const dock = new Dock();
  const figures = el("div", { class: "paper-figures" }, controls,
    el("div", { class: "results" },
      el("div", { class: "summary" }, sentence, message, weighing.message, el("div", { class: "work" }, weighing.status, weighing.bar), buttons), drawing, figure.element,
      el("section", { class: "law", tabindex: "0", "aria-label": "Numbers" }, el("h3", {}, "Values at the end of each curve"), ends)), dock.element);
  const ledgerView = el("div", { class: "ledger" });
  const switches = el("div", { class: "switch", role: "group", "aria-label": "What is shown" });
  const heading = el("h2", {}, title);
  const cite = el("p", { class: "note" });
  const papers = el("div", { class: "papers" });
  const element = el("section", { class: "tab paper", "aria-label": title },
    el("div", { class: "paper-head" }, papers, heading, cite, switches), figures, ledgerView);

  // --- The address -----------------------------------------------------------------------------

  function link() {
    const parameters = new URLSearchParams();
    if (view.paper) parameters.set("paper", view.paper);
    if (view.show !== "figures") parameters.set("show", view.show);
    if (view.show === "figures") {
      parameters.set("figure", view.figure);
      for (const [n, v] of Object.entries(view.numbers)) parameters.set(n, v);
    } else for (const n of ["status", "kind", "section", "search"]) if (view[n]) parameters.set(n, view[n]);
    page.setLink(name, parameters);
  }

  function fromParameters(parameters) {
    view.show = parameters.get("show") === "ledger" ? "ledger" : "figures";
    if (!paper.figures.some((f) => f.name === view.figure)) view.figure = paper.figures[0]?.name || "";
    if (paper.figures.some((f) => f.name === parameters.get("figure"))) view.figure = parameters.get("figure");
    if (!view.figure) view.show = "ledger";
    view.numbers = {};
    for (const { name: n } of current()?.numbers || []) {
      if (parameters.has(n)) view.numbers[n] = written(parameters.get(n));
    }
    for (const n of ["status", "kind", "section", "search"]) view[n] = parameters.get(n) || "";
  }

  const current = () => paper.figures.find((f) => f.name === view.figure);

  // --- Figures ---------------------------------------------------------------------------------

  const question = () => ({ paper: view.paper, figure: view.figure, numbers: view.numbers });

  function changed() {
    link();
    stopMass();
    sentence.textContent = asSentence();
    latest.ask(question());
  }

  function asSentence() {
    const { place, title: what, numbers } = current();
    const moved = numbers.filter((n) => n.name in view.numbers);
    if (!moved.length) return `${place}: ${what}. All numbers are as printed.`;
    const described = (n) => {
      const value = view.numbers[n.name];
      return `${n.label} = ${typeof value === "number" ? quantity(value, n.kind, 3) : value} in place of ${quantity(n.slider.value, n.kind, 3)}`;
    };
    return `${place} with ${moved.map(described).join(", ")}.`;
  }

  async function answered(response) {
    message.textContent = "";
    if (response.preparing) {
      page.say(`Compiling the equations of ${response.preparing}, once; this takes some seconds.`);
      setTimeout(() => latest.ask(question()), 500);
      return;
    }
    page.say("");
    answer = response;
    draw();
    if (current().inertia && view.show === "figures") resting = setTimeout(weigh, REST);
  }

  // --- Curves with the mass of the slider, which may take seconds ------------------------------------

  function stopMass() {
    weighing.end("");
    inertia = [];
  }

  async function weigh() {
    stopMass();
    weighing.begin("Computing the curves with the mass of the slider…");
    const done = await weighing.run("paper/inertia", question(), (part) => {
      if (part.progress !== undefined) weighing.bar.value = part.progress;
      if (!part.curve) return;
      inertia.push(part);
      draw();
    });
    if (done) weighing.end("");
  }

  function refused(why) {
    message.textContent = why;
    page.say("");
  }

  function draw() {
    if (!answer?.printed || view.show !== "figures") return;
    const { x, rows, printed, moved, stated } = answer;
    const isMoved = Object.keys(view.numbers).length > 0;
    fill(drawing, answer.element && elementDrawing(answer.element));
    const [scale, unit] = x.column === "V" ? [1e6, " (µm/s)"] : [1, ""];
    const xs = (curve) => curve.values[x.column].map((v) => scale * v);
    figure.heading.textContent = `${current().place}: ${current().title}`;
    figure.height = Math.max(360, 190 * rows.length);
    const drawn = rows.map((row) => ({
      y: { label: row.label, log: row.log },
      lines: [
        ...(isMoved ? printed.map((curve) => ({ x: xs(curve), y: curve.values[row.column], cls: "printed dashed", name: `${curve.name}, as printed` })) : []),
        ...(isMoved ? inertia.map(({ printed: c }) => ({ x: xs(c), y: c.values[row.column], cls: "printed dashed", name: `${c.name}, as printed` })) : []),
        ...moved.map((curve, k) => ({ x: xs(curve), y: curve.values[row.column], cls: series(k), name: curve.name, thick: true })),
        ...inertia.map(({ curve }, k) => ({ x: xs(curve), y: curve.values[row.column], cls: massClass(curve, k), name: curve.name })),
        ...(stated[row.column] || []).filter((s) => s.ends.length > 1).map((s) => ({ x: s.ends.map(() => s.x), y: s.ends, cls: "stated", thick: true, name: s.text })),
      ],
      points: (stated[row.column] || []).map((s) => ({ x: s.ends.map(() => s.x), y: s.ends, cls: "stated", title: s.text })),
    }));
    const places = moved.flatMap(xs);
    const range = x.log ? undefined : x.column === "phase" ? [0, 1] : [Math.min(0, ...places), 1.02 * Math.max(...places)];
    figure.draw({ x: { label: x.label + unit, log: x.log, range }, rows: drawn },
      `${asSentence()} Curves: ${moved.map((c) => c.name).join(", ")}.`);
    const hasStated = rows.some((row) => stated[row.column]);
    fill(figure.note,
      moved.map((curve, k) => key(series(k), curve.name, gaps(curve))),
      inertia.map(({ curve }, k) => key(massClass(curve, k), curve.name, gaps(curve))),
      isMoved && key("printed dashed", "as printed", ...printed.map(gaps)),
      hasStated && key("point stated", "stated in the text"));
    drawEnds();
  }

  /** Why a curve has gaps; nothing of a whole one. */
  function gaps(curve) {
    return curve.lost ? el("span", { class: "lost" }, ` – no orbit at ${curve.lost}`) : "";
  }

  /** The colour of the same curve without the mass, and a pattern that grey print keeps apart. */
  function massClass(curve, k) {
    const partner = answer.moved.findIndex((c) => curve.name.startsWith(c.name));
    return `${series(partner < 0 ? k : partner)} ${k % 2 ? "dash-dots" : "dots"}`;
  }

  function drawEnds() {
    const { rows, printed, moved, stated } = answer;
    const last = (curve, column) => curve.values[column].at(-1);
    const all = [...moved.map((curve, k) => [curve, printed[k]]), ...inertia.map((m) => [m.curve, m.printed])];
    const statements = rows.flatMap((row) => (stated[row.column] || []).map((s) =>
      el("li", {}, `${row.label} at ${digits(s.x, 3)}: ${s.ends.map((v) => digits(v, 3)).join(" to ")} (${s.text})`)));
    fill(ends, table(["Curve", "Quantity", "As printed", "With the moved numbers"],
      all.flatMap(([curve, before]) => rows.map((row) => [curve.name, row.label, digits(last(before, row.column), 4), digits(last(curve, row.column), 4)])),
      "Values at the end of each curve"),
    statements.length > 0 && el("ul", { class: "statements" }, statements));
  }

  function figureColumns() {
    if (!answer?.printed) return null;
    const columns = {};
    answer.moved.forEach((curve, k) => {
      for (const [column, values] of Object.entries(curve.values)) {
        columns[`${curve.name} ${column}`] = values;
        if (column !== answer.x.column) columns[`${curve.name} ${column} as printed`] = answer.printed[k].values[column];
      }
    });
    for (const { curve } of inertia) for (const [column, values] of Object.entries(curve.values)) columns[`${curve.name} ${column}`] = values;
    return columns;
  }

  function buildControls() {
    const chosen = current();
    const sliders = chosen.numbers.map((n) => new Quantity({
      parameter: { name: n.name, label: n.label, kind: n.kind, meaning: n.meaning, symbol: `<i>${n.label.replace(/_(\w+)/, "<sub>$1</sub>")}</i>` },
      slider: { ...n.slider, value: view.numbers[n.name] ?? n.slider.value },
      onInput: (value) => {
        if (value === n.slider.value) delete view.numbers[n.name];
        else view.numbers[n.name] = value;
        changed();
      },
    }));
    fill(controls,
      choice("Figure", paper.figures.map((f) => [f.name, `${f.place} – ${f.title}`]), view.figure, (value) => {
        view.figure = value;
        answer = null;
        const kept = current().numbers.map((n) => n.name);
        view.numbers = Object.fromEntries(Object.entries(view.numbers).filter(([n]) => kept.includes(n)));
        buildControls();
        changed();
      }),
      group("Numbers of the paper", false, sliders.map((q) => q.element)),
      el("div", { class: "actions" }, el("button", {
        type: "button", click: () => { view.numbers = {}; buildControls(); changed(); },
      }, "As printed")));
    dock.offer(sliders, chosen.numbers[0].name);
  }

  // --- Ledger ----------------------------------------------------------------------------------

  const count = el("p", { class: "sentence", role: "status" });
  const list = el("div", { class: "claims" });
  const ledgerMessage = el("p", { class: "message", role: "alert" });
  const filters = {};

  function buildLedger() {
    const changedFilter = (key) => (value) => { view[key] = value; link(); drawLedger(); };
    const all = (names, word) => [["", word], ...names.map((n) => [n, n])];
    const sections = [...new Set(paper.claims.map((c) => c.section))].sort();
    filters.status = choice("Verdict", all(VERDICTS, "all verdicts"), view.status, changedFilter("status"));
    filters.kind = choice("Kind", all(KINDS, "all kinds"), view.kind, changedFilter("kind"));
    filters.section = choice("Section", all(sections, "all sections"), view.section, changedFilter("section"));
    const id = fresh("search");
    filters.search = el("input", { type: "search", id, value: view.search, input: () => changedFilter("search")(filters.search.value) });
    fill(ledgerView,
      el("form", { class: "filters", role: "search", "aria-label": "Claims", submit: (e) => e.preventDefault() },
        filters.status, filters.kind, filters.section,
        el("div", { class: "choice" }, el("label", { for: id }, "Text"), filters.search)),
      el("div", { class: "summary" }, count, ledgerMessage, el("div", { class: "actions" },
        copies(copyLink, ["Copy as Python", ledgerPython], ["Copy as command", () => `asperity reproduce ${paper.paper.name} --out report`]),
        el("button", { type: "button", click: saveLedger }, "CSV"))),
      list);
  }

  const ledgerPython = () => `from asperity.ledger import find_paper\n\nfor claim in find_paper("${paper.paper.name}").ledger():\n    print(claim.verdict, claim.place, claim.statement, claim.computed, sep=" | ")\n`;

  function shownClaims() {
    const words = view.search.toLowerCase().split(/\s+/).filter(Boolean);
    return paper.claims.map((c) => ({ ...c, ...(verdicts?.get(c.id) || {}) })).filter((c) => {
      const text = `${c.place} ${c.statement} ${c.stated} ${c.computed || ""} ${c.why}`.toLowerCase();
      return (!view.status || c.verdict === view.status) && (!view.kind || c.kind === view.kind)
        && (!view.section || c.section === view.section) && words.every((w) => text.includes(w));
    });
  }

  function drawLedger() {
    const shown = shownClaims();
    const tally = VERDICTS.map((v) => [v, shown.filter((c) => c.verdict === v).length]).filter(([, n]) => n);
    const waits = view.status && !verdicts;
    count.textContent = waits ? "The verdicts are being computed…"
      : `${shown.length} of ${paper.claims.length} claims${tally.length ? `: ${tally.map(([v, n]) => `${n} ${v}`).join(", ")}` : ""}.`;
    fill(list, shown.map((c) => el("article", { class: "claim", "data-verdict": c.verdict || "" },
      el("p", { class: "claim-head" },
        el("span", { class: "badge" }, c.verdict || "…"), el("span", { class: "kind" }, c.kind), el("span", { class: "place" }, c.place)),
      el("h3", {}, c.statement),
      el("dl", {}, el("dt", {}, "Stated"), el("dd", {}, c.stated),
        el("dt", {}, "Computed"), el("dd", {}, c.computed || "…")),
      el("details", {}, el("summary", {}, "How it was computed, and what it means"),
        c.rule && el("p", {}, `Rule: ${c.rule}.`), el("p", {}, c.how), el("p", {}, c.why)))));
  }

  function saveLedger() {
    saveRows("claims.csv", shownClaims(), ["id", "place", "kind", "statement", "stated", "computed", "verdict"]);
  }

  async function computeLedger() {
    if (verdicts || judging.current) return;
    const judged = await judging.run("paper/ledger", { paper: view.paper }, (m) => {
      if (m.finished) page.say(`${m.finished} of ${m.total} claims computed`);
    });
    if (!judged) return;
    verdicts = new Map(judged.claims.map((c) => [c.id, c]));
    page.say("");
    if (view.show === "ledger") drawLedger();
  }

  function buildSwitches() {
    const views = [["figures", "Figures"], ["ledger", "Ledger"]].filter(([key]) => key === "ledger" || paper.figures.length);
    fill(switches, views.map(([key, text]) => el("button", {
      type: "button", "aria-pressed": String(view.show === key),
      click: () => { view.show = key; stopMass(); present(); link(); },
    }, text)));
  }

  /** The choice of a paper, if several are installed. */
  function buildPapers() {
    fill(papers, paper.papers.length > 1 && choice("Paper", paper.papers.map((p) => [p.name, p.short]), paper.paper.name, async (value) => {
      Object.assign(view, { paper: value, figure: "", numbers: {} });
      await open(new URLSearchParams());
      link();
    }));
  }

  /** Ask for the words of the chosen paper, and show them. */
  async function open(parameters) {
    stopMass();
    judging.stop();
    [answer, verdicts] = [null, null];
    const opened = await opening.ask("paper", { paper: view.paper });
    if (!opened) return;
    message.textContent = "";
    paper = opened;
    heading.textContent = paper.paper.title;
    cite.textContent = `${paper.paper.authors}, ${paper.paper.journal}`;
    fromParameters(parameters);
    buildPapers();
    present();
  }

  function present() {
    buildSwitches();
    figures.hidden = view.show !== "figures";
    ledgerView.hidden = view.show !== "ledger";
    if (view.show === "figures") {
      buildControls();
      changed();
      draw();
    } else {
      buildLedger();
      drawLedger();
      computeLedger();
    }
  }

  return {
    element,
    async show(parameters) {
      const wanted = parameters.get("paper") || "";
      if (!paper || wanted !== view.paper) {
        view.paper = wanted;
        await open(parameters);
        return;
      }
      fromParameters(parameters);
      present();
    },
    hide: stopMass,
  };
}
