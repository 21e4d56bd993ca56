// Map: stability and response over two numbers.

import { Figure, key } from "../lib/charts.js";
import { picture, stops } from "../lib/colours.js";
import { choice, entry, group, inertiaTick, neededNumbers, tick } from "../lib/controls.js";
import { el, fill } from "../lib/dom.js";
import { copies, copyLink, textsOf } from "../lib/save.js";
import { Task } from "../lib/task.js";
import { digits, quantity, written } from "../lib/units.js";
import { count, nameOf } from "../lib/words.js";

export const name = "map";
export const title = "Map";

/** Time (ms) without a change after which a map begins. */
const REST = 300;
/** Quantities with a sign, drawn about zero. */
const SIGNED = ["growth_rate", "log_multiplier", "delta_mu", "phase1", "phase2"];
const SHOWN = ["growth_rate", "mu1", "mu2", "mean_friction", "delta_mu", "phase1", "phase2", "mode_frequency"];
const FINEST = [16, 32, 64, 128];

export function create(page) {
  const { catalogue } = page;
  const laws = Object.keys(catalogue.laws);
  const view = fresh();
  let figure = null;
  let grid = null;
  let resting = 0;
  let shown = null;
  let marker = null;

  function fresh() {
    const material = Object.keys(catalogue.materials)[0];
    const { sliders } = catalogue.materials[material];
    const side = (n) => ({ name: n, low: sliders[n].low, high: sliders[n].high, log: sliders[n].log });
    return {
      material, law: laws.includes("rice-ruina") ? "rice-ruina" : laws[0],
      // Without modulation there is nothing to map along that edge.
      x: { ...side("epsilon"), low: sliders.epsilon.high / 50 }, y: side("K"),
      show: "growth_rate", count: 64, numbers: {},
    };
  }

  const parametersOf = (law) => catalogue.laws[law].parameters.filter((p) => p.rule !== "switch");
  const parameter = (n) => parametersOf(view.law).find((p) => p.name === n);
  const sliderOf = (n) => catalogue.materials[view.material].sliders[n];

  // --- The address ---------------------------------------------------------------------------

  function toParameters() {
    const parameters = new URLSearchParams({
      material: view.material, law: view.law, show: view.show, count: view.count,
    });
    for (const side of ["x", "y"]) {
      const { name: n, low, high, log } = view[side];
      parameters.set(side, [n, low, high, log ? "log" : "linear"].join(","));
    }
    for (const [n, v] of Object.entries(view.numbers)) parameters.set(n, v);
    return parameters;
  }

  function fromParameters(parameters) {
    Object.assign(view, fresh());
    if (catalogue.materials[parameters.get("material")]) view.material = parameters.get("material");
    if (catalogue.laws[parameters.get("law")]) view.law = parameters.get("law");
    if (SHOWN.includes(parameters.get("show"))) view.show = parameters.get("show");
    if (FINEST.includes(Number(parameters.get("count")))) view.count = Number(parameters.get("count"));
    for (const side of ["x", "y"]) {
      const [n, low, high, log] = (parameters.get(side) || "").split(",");
      if (parameter(n)) view[side] = { name: n, low: written(low), high: written(high), log: log === "log" };
    }
    for (const [n, text] of parameters) if (parameter(n) || n === "inertia") view.numbers[n] = written(text);
  }

  // --- Asking ----------------------------------------------------------------------------------

  function question() {
    const numbers = { ...neededNumbers(catalogue, view.material, [view.law]), ...view.numbers };
    for (const side of ["x", "y"]) delete numbers[view[side].name];
    return {
      material: view.material, law: view.law, numbers, x: view.x, y: view.y, show: view.show,
      count: view.count,
    };
  }

  function changed() {
    page.setLink(name, toParameters());
    solving.stop();
    resting = setTimeout(start, REST);
  }

  const solving = new Task("Progress of the map", { statusClass: "status", onEnd: () => clearTimeout(resting) });
  const { status, message } = solving;

  async function start() {
    const solved = question();
    solving.begin("Solving the first, coarse grid…");
    const done = await solving.run("map", solved, (part) => {
      if (part.waiting) status.textContent = "Waiting for another map to be done…";
      if (part.progress !== undefined) solving.bar.value = part.progress;
      if (!part.grid) return;
      grid = part.grid;
      shown = solved;
      draw();
      if (grid.count < solved.count) status.textContent = `${grid.count} × ${grid.count} points; a finer grid is being solved…`;
    });
    if (done) solving.end(`${grid.count} × ${grid.count} points.`);
  }

  // --- The figure ------------------------------------------------------------------------------

  function axisOf(side) {
    const p = parameter(side.name);
    return {
      label: p.meaning, log: side.log, range: [side.low, side.high],
      format: (v) => quantity(v, p.kind, 3),
    };
  }

  function draw() {
    if (!grid || !shown || shown.law !== view.law) return;
    const known = grid.values.flat().filter((v) => v !== null).sort((a, b) => a - b);
    const at = (share) => known[Math.min(known.length - 1, Math.floor(share * known.length))];
    const signed = SIGNED.includes(shown.show);
    // A few extreme points would give all others the same colour.
    const far = signed ? Math.max(Math.abs(at(0.02)), Math.abs(at(0.98))) || 1 : 0;
    const limits = signed ? [-far, far] : [at(0.02), at(0.98) > at(0.02) ? at(0.98) : at(0.02) + 1];
    const colours = signed ? "vik" : "batlow";
    const [x, y] = [axisOf(withSi(shown.x, grid.x)), axisOf(withSi(shown.y, grid.y))];
    const critical = grid.unmodulated && { x: grid.unmodulated[0], y: grid.unmodulated[1] };
    const output = catalogue.outputs[shown.show];
    figure.height = Math.min(560, Math.max(320, figure.plot.clientWidth));
    figure.draw({
      x,
      rows: [{
        y,
        image: { url: known.length ? picture(grid.values, colours, limits) : "", x: corners(grid.x, x.log), y: corners(grid.y, y.log) },
        words: grid.regions,
        colours: { stops: stops(colours), low: limits[0], high: limits[1], label: `${output.meaning}${output.unit === "1" ? "" : ` (${output.unit})`}` },
        lines: [critical && { ...critical, cls: "boundary", dashed: true, name: "K = Kc without modulation" }, ...(grid.boundaries || []).flatMap((line) => ["boundary-halo", "boundary"].map((cls) => ({ x: line.x, y: line.y, cls, thick: true })))].filter(Boolean),
        points: marker ? [{ x: [marker[0]], y: [marker[1]], cls: "ink", size: 6 }] : [],
        readout: (px, py) => readAt(px, py),
      }],
    }, description());
    fill(figure.note,
      critical && key("dashed boundary", "K = Kc: without modulation, sliding is stable above it"),
      grid.boundaries === null && el("p", {}, "The stability boundary comes with the next, finer grid."),
      [...new Set((grid.boundaries || []).map(describeLine))].map((text) => key("boundary", text)),
      grid.boundaries === null || grid.boundaries.length || !known.length ? null : el("p", {}, grid.stable.flat().some(Boolean) ? "No stability boundary here: stable wherever there is an orbit." : "No stability boundary here: unstable everywhere."),
      grid.failed ? el("p", { class: "lost" }, `${grid.failed} of ${grid.count ** 2} points have no orbit: ${grid.reasons.join("; ")}`) : null,
      grid.reverses ? el("p", {}, `At ${grid.reverses} of ${grid.count ** 2} points slip would reverse for part of the period, and this law slips forwards only.`) : null,
      grid.not_located ? el("p", {}, `At ${count(grid.not_located, "place")} stability changes, but no boundary was located there.`) : null);
  }

  /** An axis with its ends in SI, as the server understood them. */
  function withSi(side, values) {
    return { ...side, low: values[0], high: values.at(-1) };
  }

  function describeLine(line) {
    const kinds = [...new Set(line.kind)].filter(Boolean).join(" and ");
    const turning = line.mode_frequency.filter((f) => f > 0);
    const [low, high] = [Math.min(...turning), Math.max(...turning)].map((f) => digits(f, 3));
    const hertz = turning.length ? `, where a disturbance swings at ${low === high ? low : `${low} to ${high}`} Hz` : "";
    return `Stability boundary: ${kinds}${hertz}`;
  }

  function description() {
    return `Map of ${catalogue.outputs[shown.show].meaning} for ${shown.law}. ${(grid.boundaries || []).map(describeLine).join(". ")}`;
  }

  function corners(values, log) {
    const n = values.length;
    const f = log ? Math.log : (v) => v;
    const back = log ? Math.exp : (v) => v;
    const half = (f(values[n - 1]) - f(values[0])) / (n - 1) / 2;
    return [back(f(values[0]) - half), back(f(values[n - 1]) + half)];
  }

  function nearest(values, v, log) {
    const f = log ? Math.log : (u) => u;
    let best = 0;
    values.forEach((u, i) => { if (Math.abs(f(u) - f(v)) < Math.abs(f(values[best]) - f(v))) best = i; });
    return best;
  }

  function readAt(px, py) {
    if (!grid) return "";
    const i = nearest(grid.x, px, shown.x.log);
    const j = nearest(grid.y, py, shown.y.log);
    const value = grid.values[j][i];
    const [p, q] = [parameter(shown.x.name), parameter(shown.y.name)];
    const where = `${p.name} ${quantity(px, p.kind, 3)}, ${q.name} ${quantity(py, q.kind, 3)}`;
    return value === null ? `${where}: no orbit` : `${where}: ${digits(value, 4)}, ${grid.stable[j][i] ? "stable" : "unstable"}`;
  }

  function openExplore([px, py]) {
    const parameters = new URLSearchParams({ material: shown.material, law: shown.law, laws: "" });
    for (const [n, v] of Object.entries(shown.numbers)) parameters.set(n, v);
    parameters.set(shown.x.name, Number(px.toPrecision(4)));
    parameters.set(shown.y.name, Number(py.toPrecision(4)));
    page.open("explore", parameters);
  }

  function pressed(event) {
    if (!grid) return;
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (event.key === "Enter" && marker) openExplore(marker);
    if (!steps) return;
    event.preventDefault();
    const middle = Math.floor(grid.count / 2);
    const [i, j] = marker
      ? [nearest(grid.x, marker[0], shown.x.log) + steps[0], nearest(grid.y, marker[1], shown.y.log) + steps[1]]
      : [middle, middle];
    const inside = (k) => Math.max(0, Math.min(grid.count - 1, k));
    marker = [grid.x[inside(i)], grid.y[inside(j)]];
    draw();
    status.textContent = readAt(...marker);
  }

  // --- Controls --------------------------------------------------------------------------------

  const controls = el("form", { class: "controls", "aria-label": "Map", submit: (e) => e.preventDefault() });

  function buildControls() {
    const names = parametersOf(view.law).map((p) => [p.name, `${nameOf(p.name)} – ${p.meaning}`]);
    const rebuild = () => { buildControls(); changed(); };
    const axisControls = (side, label) => {
      const p = parameter(view[side].name);
      const field = (end, text) => entry({
        parameter: { ...p, meaning: `${text} of ${label}` }, label: text, value: view[side][end],
        onInput: (value) => { view[side][end] = value; changed(); },
      });
      return group(label, true,
        choice("Number", names, view[side].name, (value) => {
          const { low, high, log } = sliderOf(value);
          view[side] = { name: value, low, high, log };
          marker = null;
          rebuild();
        }),
        el("div", { class: "ends" }, field("low", "from"), field("high", "to")),
        tick("At equal ratios (logarithmic)", view[side].log, (on) => { view[side].log = on; changed(); }));
    };
    const others = parametersOf(view.law).filter((p) => ![view.x.name, view.y.name].includes(p.name));
    fill(controls,
      choice("Law", laws.map((n) => [n, n]), view.law, (value) => {
        view.law = value;
        for (const side of ["x", "y"]) {
          if (!parameter(view[side].name)) view[side] = fresh()[side];
        }
        marker = null;
        rebuild();
      }),
      axisControls("x", "Across"),
      axisControls("y", "Up"),
      group("Picture", false,
        choice("Shows", SHOWN.map((n) => [n, catalogue.outputs[n].meaning]), view.show, (value) => { view.show = value; changed(); }),
        choice("Finest grid", FINEST.map((n) => [n, `${n} × ${n}`]), view.count, (value) => { view.count = Number(value); changed(); })),
      group("Other numbers", false,
        inertiaTick(view.numbers, changed),
        others.map((p) => entry({
          parameter: p, value: view.numbers[p.name] ?? sliderOf(p.name).value,
          onInput: (value) => { view.numbers[p.name] = value; changed(); },
        }))),
      el("div", { class: "actions" },
        el("button", { type: "button", click: () => { Object.assign(view, fresh()); marker = null; rebuild(); } }, "Start again")));
  }

  const results = el("div", { class: "results" }, el("h2", { class: "visually-hidden" }, "Stability map"));
  const element = el("section", { class: "tab map", "aria-label": title }, controls, results);

  return {
    element,
    renamed() { buildControls(); draw(); },
    show(parameters) {
      if (!figure) {
        figure = new Figure({
          name: "stability-map", title: "Response and stability", height: 560,
          ownLabel: "Map: arrow keys move a point, Enter takes it to Explore",
          columns: () => grid && {
            [shown.x.name]: grid.y.flatMap(() => grid.x),
            [shown.y.name]: grid.y.flatMap((v) => grid.x.map(() => v)),
            [shown.show]: grid.values.flat(),
            stable: grid.stable.flat(),
          },
        });
        figure.plot.addEventListener("keydown", pressed);
        figure.plot.addEventListener("click", (event) => {
          const at = figure.at(event);
          if (at && grid) openExplore(at);
        });
        results.append(
          el("div", { class: "summary" }, el("p", { class: "hint" }, "A click takes the point to Explore; with the keyboard, arrow keys and Enter."),
            el("div", { class: "work" }, status, solving.bar, solving.cancel), message,
            el("div", { class: "actions" }, copies(copyLink, ...textsOf("map/text", question, (why) => { message.textContent = why; })))),
          figure.element);
      }
      fromParameters(parameters);
      buildControls();
      changed();
    },
    hide: () => solving.stop(),
  };
}
