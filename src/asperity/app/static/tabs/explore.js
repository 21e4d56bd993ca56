// Explore: an operating point, whose response follows the sliders.

import { Figure, key, series } from "../lib/charts.js";
import { choice, Dock, group, inertiaTick, neededNumbers, Quantity, tick } from "../lib/controls.js";
import { el, fill, formula } from "../lib/dom.js";
import { copies, copyLink, textsOf } from "../lib/save.js";
import { Latest, Work } from "../lib/server.js";
import { digits, quantity, written } from "../lib/units.js";
import { capital, worded } from "../lib/words.js";
import { Machine } from "./explore/machine.js";
import { MotionPanel } from "./explore/motion.js";

export const name = "explore";
export const title = "Explore";

/** Time (ms) without a movement after which a search starts. */
const PAUSE = 250;
/** Time (ms) after which the page says why an answer takes longer than usual. */
const SLOW = 1000;
/** Numbers of the drive and of the machine, in the order of the page; those of the law follow. */
const FIRST = ["V", "epsilon", "frequency", "W0", "K", "M"];
/** Curves against the amplitude. */
const CURVES = ["mean_friction", "mu1", "mu2", "phase1", "phase2"];

export function create(page) {
  const { catalogue } = page;
  const laws = Object.keys(catalogue.laws);
  const view = fresh();
  let figures = null;
  let machine = null;
  let motion = null;
  let resting = 0;
  let slow = 0;
  let compiling = null;
  let answer = null;
  let sliders = [];

  function fresh() {
    return {
      material: Object.keys(catalogue.materials)[0],
      law: laws.includes("elasto-plastic") ? "elasto-plastic" : laws[0],
      laws: ["rice-ruina", "linker-dieterich"].filter((n) => laws.includes(n)),
      numbers: {}, air: null, phases: false,
    };
  }

  const latest = new Latest("explore", answered, refused);
  const searching = new Work(refused);

  // --- The address ---------------------------------------------------------------------------

  function toParameters() {
    const parameters = new URLSearchParams();
    parameters.set("material", view.material);
    parameters.set("law", view.law);
    parameters.set("laws", view.laws.join(","));
    for (const [n, v] of Object.entries(view.numbers)) parameters.set(n, v);
    if (view.air) {
      parameters.set("air", "1");
      for (const [n, v] of Object.entries(view.air)) parameters.set(`air.${n}`, v);
    }
    if (view.phases) parameters.set("show", "phases");
    return parameters;
  }

  function fromParameters(parameters) {
    Object.assign(view, fresh());
    if (catalogue.materials[parameters.get("material")]) view.material = parameters.get("material");
    if (catalogue.laws[parameters.get("law")]) view.law = parameters.get("law");
    if (parameters.has("laws")) {
      view.laws = parameters.get("laws").split(",").filter((n) => catalogue.laws[n]);
    }
    view.phases = parameters.get("show") === "phases";
    const sliders = catalogue.materials[view.material].sliders;
    for (const [n, text] of parameters) {
      if (n in sliders) view.numbers[n] = written(text);
      else if (n.startsWith("air.")) (view.air ||= {})[n.slice(4)] = written(text);
    }
    if (parameters.get("air") === "1") view.air ||= {};
  }

  // --- Asking and drawing ----------------------------------------------------------------------

  function question() {
    const sliders = catalogue.materials[view.material].sliders;
    const drive = Object.fromEntries(["V", "epsilon", "frequency"].map((n) => [n, sliders[n].value]));
    return {
      material: view.material, law: view.law, laws: view.laws,
      numbers: { ...neededNumbers(catalogue, view.material, [view.law, ...view.laws]), ...drive, ...view.numbers },
      air: view.air,
    };
  }

  function changed() {
    page.setLink(name, toParameters());
    onPaper.textContent = `${view.material}, ${view.law}: ${sliders.map((q) => `${q.parameter.name} = ${q.field.value}`).join(", ")}${view.numbers.inertia ? ", with inertia" : ""}.`;
    stopSearch();
    latest.ask(question(), { since: performance.now() });
    clearTimeout(slow);
    slow = setTimeout(() => {
      const text = "Computing. Programs that these numbers need are compiled once, which takes some seconds.";
      page.say(text);
      if (!answer?.point) sentence.textContent = text;
    }, SLOW);
  }

  function stopSearch() {
    motion.stop();
    clearTimeout(resting);
    searching.stop();
  }

  async function answered(response, { since }, more) {
    answer = response;
    message.textContent = "";
    clearTimeout(slow);
    sayPreparing(response);
    if (response.preparing) {
      resting = setTimeout(() => latest.ask(question(), { since: performance.now() }), 400);
    }
    if (!response.point) return;
    draw();
    // The picture is on the screen after the next frame.
    await new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve)));
    performance.measure("slider to picture", { start: since, end: performance.now() });
    if (performance.getEntriesByName("slider to picture").length > 1000) {
      performance.clearMeasures("slider to picture");
    }
    const open = !response.point.searched || Object.values(response.curves).some((c) => c.left.length);
    if (more || latest.pending || response.preparing) return;
    if (open) resting = setTimeout(search, PAUSE);
    if (response.point.searched) motion.ask(question(), response.point);
  }

  /** Say which law is compiled and for how long already: nothing can be drawn of it before. */
  function sayPreparing({ preparing, point }) {
    if (!preparing) compiling = null;
    else if (compiling?.law !== preparing) compiling = { law: preparing, since: performance.now() };
    if (!preparing) return page.say("");
    const passed = Math.round((performance.now() - compiling.since) / 1000);
    const text = `Compiling the equations of ${preparing} for this computer, once: usually less than 20 s${passed > 2 ? `, ${passed} s so far` : ""}.`;
    if (point) return page.say(text);
    sentence.dataset.state = "searching";
    sentence.textContent = text;
    return page.say("Compiling…");
  }

  function refused(why) {
    clearTimeout(slow);
    message.textContent = why;
    page.say("");
  }

  function search() {
    return searching.run("explore/search", question(), (part) => {
      if (part.point) {
        const known = answer.point.searched;
        answer.point = part.point;
        if (!known) motion.ask(question(), answer.point);
      } else if (part.curve) {
        const curve = answer.curves[part.curve];
        part.rows.forEach((row, i) => {
          for (const n of CURVES) curve[n][row] = part[n][i];
          if (!part.converged[i] && !curve.lost) {
            curve.lost = { at: answer.amplitudes[row], row, why: part.result[i] };
          }
        });
        curve.left = curve.left.filter((row) => !part.rows.includes(row));
      } else return;
      draw();
    });
  }

  // --- Figures ---------------------------------------------------------------------------------

  function makeFigures() {
    return {
      period: new Figure({
        name: "period", title: "One period", height: 400,
        caption: "At low load the slider slips fast and the contacts stay young; at high load they age.",
        columns: () => answer.point?.converged && {
          phase: answer.point.phase, force: answer.point.force, slip_velocity: answer.point.slip,
          ...(answer.point.age ? { age: answer.point.age } : {}),
        },
      }),
      amplitude: new Figure({
        name: "amplitude", title: "Against the amplitude", height: 400, columns: amplitudeColumns,
        options: phases,
        caption: "Modulation lowers the mean friction; the laws differ most in the harmonics.",
      }),
      harmonics: new Figure({
        name: "harmonics", title: "Harmonics of the force", height: 230,
        caption: "What a lock-in amplifier reads at the frequency of the load and its multiples.",
        columns: () => answer.point?.converged && {
          harmonic: answer.point.harmonics.map((_, i) => i + 1),
          real: answer.point.harmonics.map((c) => c[0]),
          imaginary: answer.point.harmonics.map((c) => c[1]),
          amplitude: answer.point.harmonics.map(([a, b]) => Math.hypot(a, b)),
        },
      }),
      multipliers: new Figure({
        name: "multipliers", title: "Floquet multipliers", height: 230,
        caption: "Each period multiplies a small disturbance by these numbers: inside the circle it dies out.",
        columns: () => answer.point?.converged && {
          real: answer.point.multipliers.map((m) => m[0]),
          imaginary: answer.point.multipliers.map((m) => m[1]),
        },
      }),
      air: new Figure({
        name: "air", title: "Air layer", height: 230,
        caption: "Air between the surfaces carries a part of the modulation; the contacts feel what remains.",
        columns: () => answer.air && {
          frequency: answer.air.frequency, share: answer.air.share, phase: answer.air.phase,
        },
      }),
    };
  }

  function amplitudeColumns() {
    if (!answer?.curves) return null;
    const columns = { epsilon: answer.amplitudes };
    for (const [law, curve] of Object.entries(answer.curves)) {
      for (const n of CURVES) columns[`${law} ${n}`] = curve[n];
    }
    return columns;
  }

  function draw() {
    if (!answer || !answer.point) return;
    drawSentence();
    machine.show(answer.point, answer.epsilon);
    drawPeriod();
    drawHarmonics();
    drawMultipliers();
    drawAmplitude();
    drawAir();
  }

  function drawSentence() {
    const { point } = answer;
    const word = !point.searched ? "searching" : !point.converged ? "lost" : point.stable ? "stable" : "unstable";
    sentence.dataset.state = word;
    const text = word === "searching"
      ? "Searching for the orbit…"
      : word === "lost" ? `No orbit: ${point.result}.` : `${capital(point.result)}.`;
    if (sentence.textContent !== text) sentence.textContent = text;
    const shown = point.converged
      ? [
        ["mean F/W₀", digits(point.mean_friction, 5)], ["Δμ̄", digits(point.delta_mu, 4)],
        ["μ₁", digits(point.mu1, 4)], ["phase of μ₁", `${digits(point.phase1, 3)} rad`],
        ["μ₂", digits(point.mu2, 4)], ["ε on the contacts", digits(answer.epsilon, 4)],
      ]
      : [["ε on the contacts", digits(answer.epsilon, 4)]];
    fill(readings, shown.map(([label, value]) => el("div", {}, el("dt", {}, worded(label)), el("dd", {}, value))));
  }

  function drawPeriod() {
    const { point } = answer;
    const x = { label: "time over the period", range: [0, 1] };
    if (!point.converged) return figures.period.draw(nothing(x), "No orbit.");
    const rows = [["F/W₀", point.force], ["slip rate / V", point.slip]];
    if (point.age) rows.push(["age / steady", point.age]);
    return figures.period.draw({
      x,
      rows: rows.map(([label, y]) => ({ y: { label }, lines: [{ x: point.phase, y, cls: series(0), thick: true }] })),
    }, `Force from ${digits(Math.min(...point.force))} to ${digits(Math.max(...point.force))} W₀, ` +
      `slip up to ${digits(Math.max(...point.slip))} V.`);
  }

  function drawHarmonics() {
    const { point } = answer;
    const x = { label: "harmonic n" };
    if (!point.converged) return figures.harmonics.draw(nothing(x), "No orbit.");
    const size = point.harmonics.map(([a, b]) => Math.hypot(a, b));
    const order = size.map((_, i) => i + 1);
    const largest = Math.max(...size);
    const phase = (i) => digits(Math.atan2(point.harmonics[i][1], point.harmonics[i][0]), 3);
    return figures.harmonics.draw({
      x: { ...x, format: String, range: [0.4, size.length + 0.6], ticks: order },
      rows: [{
        y: { label: "amplitude μₙ", log: true, range: [Math.max(Math.min(...size.filter((s) => s > 0)) / 3, largest * 1e-9), largest * 2] },
        bars: [{ x: order, y: size, cls: series(0), title: (i) => `μ${i + 1} = ${digits(size[i])}, phase ${phase(i)} rad` }],
      }],
    }, size.map((s, i) => `μ${i + 1} ${digits(s, 3)}`).join(", "));
  }

  function drawMultipliers() {
    const { point } = answer;
    const x = { label: "real part" };
    if (!point.converged) return figures.multipliers.draw(nothing(x), "No orbit.");
    const known = point.multipliers.filter((m) => m[0] !== null);
    const far = 1.15 * Math.max(1, ...known.map(([a, b]) => Math.hypot(a, b)));
    return figures.multipliers.draw({
      x: { ...x, range: [-far, far] },
      rows: [{
        y: { label: "imaginary part", range: [-far, far] }, equal: true, circle: 1,
        points: [{
          x: known.map((m) => m[0]), y: known.map((m) => m[1]), cls: point.stable ? "good" : "bad",
          title: (i) => `m = ${digits(known[i][0], 5)} ${known[i][1] < 0 ? "−" : "+"} ${digits(Math.abs(known[i][1]), 5)} i, |m| = ${digits(Math.hypot(...known[i]), 5)}`,
        }],
      }],
    }, point.result);
  }

  function drawAmplitude() {
    const shown = view.phases
      ? [["phase of μ₁ (rad)", "phase1"], ["phase of μ₂ (rad)", "phase2"]]
      : [["mean F/W₀", "mean_friction"], ["μ₁", "mu1"], ["μ₂", "mu2"]];
    const curves = Object.entries(answer.curves);
    const rows = shown.map(([label, key]) => ({
      y: { label },
      marks: [answer.epsilon],
      // Dashed over full lines: curves that coincide show both.
      lines: curves.map(([law, curve], k) => ({
        x: answer.amplitudes, y: curve[key], cls: series(k), name: law, thick: law === view.law, dashed: law !== view.law, smooth: true,
      })).sort((a, b) => b.thick - a.thick),
      points: curves.filter(([, curve]) => curve.lost?.row > 0).map(([law, curve]) => ({
        x: [answer.amplitudes[curve.lost.row - 1]], y: [curve[key][curve.lost.row - 1]], cross: true,
        cls: series(curves.findIndex(([n]) => n === law)), title: `${law}: ${curve.lost.why}`,
      })),
    }));
    fill(figures.amplitude.note,
      curves.map(([law, curve], k) => key(`${series(k)} ${law === view.law ? "" : "dashed"}`, law,
        curve.lost ? el("span", { class: "lost" }, ` – no orbit from ε = ${digits(curve.lost.at, 3)}: ${curve.lost.why}`)
          : curve.left.length ? " …" : "")));
    const high = Math.max(answer.amplitudes.at(-1), answer.epsilon * 1.03);
    return figures.amplitude.draw({ x: { label: "ε on the contacts", range: [0, high] }, rows },
      `Curves of ${curves.map(([law]) => law).join(", ")}.`);
  }

  function drawAir() {
    const { air } = answer;
    figures.air.element.hidden = !air;
    if (!air) return null;
    const here = answer.numbers.frequency;
    figures.air.note.textContent =
      `At ${quantity(here, "frequency")} the contacts bear ` +
      `${digits(100 * air.share_here, 3)} % of the modulation, ${digits(Math.abs(air.phase_here), 3)} rad ` +
      `${air.phase_here < 0 ? "behind" : "ahead of"} the load; the air layer carries the remainder.`;
    return figures.air.draw({
      x: { label: "frequency", log: true, format: (v) => quantity(v, "frequency", 3) },
      rows: [{
        y: { label: "share εeff/ε", range: [0, 1.05 * Math.max(1, ...air.share)] },
        marks: [here],
        lines: [{ x: air.frequency, y: air.share, cls: series(0), thick: true }],
        points: [{ x: [here], y: [air.share_here], cls: series(1) }],
      }],
    }, figures.air.note.textContent);
  }

  function nothing(x) {
    return {
      x: { ...x, range: [0, 1], ticks: [] },
      rows: [{ y: { label: "", range: [0, 1], ticks: [] }, text: answer.point.searched ? "no orbit" : "searching…" }],
    };
  }

  // --- Controls --------------------------------------------------------------------------------

  const controls = el("form", { class: "controls", "aria-label": "Operating point", submit: (e) => e.preventDefault() });
  const dock = new Dock();
  const sentence = el("p", { class: "sentence", role: "status" });
  const readings = el("dl", { class: "readings" });
  const onPaper = el("p", { class: "on-paper" });
  const message = el("p", { class: "message", role: "alert" });
  const equations = el("div", { class: "equations" });

  function buildControls() {
    const material = catalogue.materials[view.material];
    const law = catalogue.laws[view.law];
    const byName = Object.fromEntries(law.parameters.map((p) => [p.name, p]));
    sliders = [];
    const slider = (options) => {
      sliders.push(new Quantity(options));
      return sliders.at(-1).element;
    };
    // With an air layer the contacts bear a share of what is applied.
    const applied = (p) => (p.name === "epsilon" && view.air !== null
      ? { ...p, meaning: "relative amplitude of the load as applied" } : p);
    const sliderOf = (p) => slider({
      parameter: applied(p),
      slider: { ...material.sliders[p.name], value: view.numbers[p.name] ?? material.sliders[p.name].value },
      onInput: (value) => { view.numbers[p.name] = value; changed(); },
    });
    const ofLaw = law.parameters.filter((p) => p.place === "law");
    const rebuild = () => { buildControls(); changed(); };
    fill(controls,
      choice("Material", Object.entries(catalogue.materials).map(([n, m]) => [n, `${n} – ${m.title}`]), view.material,
        (value) => { view.material = value; view.numbers = {}; rebuild(); }),
      choice("Law", laws.map((n) => [n, n]), view.law, (value) => { view.law = value; rebuild(); }),
      group("Drive and machine", false,
        FIRST.filter((n) => byName[n]).map((n) => sliderOf(byName[n])),
        inertiaTick(view.numbers, changed)),
      group("Law", false, ofLaw.map(sliderOf)),
      group("Air layer", false,
        tick("Air between the surfaces", view.air !== null, (on) => { view.air = on ? {} : null; rebuild(); },
          "ε is then the amplitude of the load, of which the contacts bear a share"),
        view.air === null ? [] : material.air.map((p) => slider({
          parameter: p,
          slider: { ...p.slider, value: view.air[p.name] ?? p.value },
          onInput: (value) => { view.air[p.name] = value; changed(); },
        }))),
      group("Compare with", false,
        laws.filter((n) => n !== view.law).map((n) => tick(n, view.laws.includes(n), (on) => {
          view.laws = laws.filter((m) => (m === n ? on : view.laws.includes(m)));
          changed();
        }, catalogue.laws[n].title))),
      el("div", { class: "actions" },
        el("button", { type: "button", click: () => { Object.assign(view, fresh()); rebuild(); } }, "Start again")),
    );
    dock.offer(sliders, "epsilon");
    fill(equations, el("p", { class: "law-title" }, law.title), law.equations.map((e) => el("div", { class: "equation" }, formula(e))));
  }

  const element = el("section", { class: "tab explore", "aria-label": title },
    controls,
    el("div", { class: "results" }, el("h2", { class: "visually-hidden" }, "Response")),
    dock.element);
  const results = element.querySelector(".results");

  const phases = tick("phases", view.phases, (on) => {
    view.phases = on;
    page.setLink(name, toParameters());
    draw();
  }, "Phases of the harmonics in place of their amplitudes");
  const buttons = el("div", { class: "actions" }, copies(copyLink, ...textsOf("explore/text", question, refused)));

  return {
    element,
    renamed() { buildControls(); changed(); },
    show(parameters) {
      if (!figures) {
        figures = makeFigures();
        machine = new Machine();
        motion = new MotionPanel((moved) => machine.follow(moved));
        results.append(el("div", { class: "summary" }, sentence, readings, onPaper, message, buttons),
          el("div", { class: "panels" }, figures.period.element, figures.amplitude.element, motion.element, machine.element,
            figures.harmonics.element, figures.multipliers.element, figures.air.element),
          el("section", { class: "law", tabindex: "0", "aria-label": "Equations" }, el("h3", {}, "Equations"), equations));
      }
      fromParameters(parameters);
      phases.querySelector("input").checked = view.phases;
      buildControls();
      changed();
    },
  };
}
