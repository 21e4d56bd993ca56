// Stick-slip: the events of a recording on its trace, their catalogue, and drops against stick times.

import { Figure, series } from "../../lib/charts.js";
import { el } from "../../lib/dom.js";
import { csv, saveFile } from "../../lib/save.js";
import { table } from "../../lib/tables.js";
import { digits, withDoubt } from "../../lib/units.js";
import { capital, count } from "../../lib/words.js";

/** Events that are listed and drawn; the CSV has all. */
const MOST = 2000;
const COLUMNS = [
  ["onset", "Onset (s)"], ["stick_duration", "Stick (s)"], ["slip_duration", "Slip (s)"],
  ["force_before", "F/W before"], ["force_after", "F/W after"], ["drop", "Drop"], ["creep", "Creep"],
  ["slip", "Slip (µm)", 1e6], ["slip_velocity", "Velocity (mm/s)", 1e3], ["energy", "Energy (µJ)", 1e6],
];

/** What the recording is, in words. */
export function stickSlipSentence(record) {
  return `${capital(record.regime)}: ${count(record.events, "slip event")}`
    + (record.drop === undefined ? "" : `, mean drop ${digits(record.drop, 3)} of F/W`)
    + (record.recurrence === undefined ? "" : `, every ${digits(record.recurrence, 3)} s`);
}

/** Figures of a stick-slip recording; `whole` is that of its trace. */
export function stickSlip({ record, curves }, whole) {
  const events = record.catalogue.slice(0, MOST);
  const ends = (list) => ({
    lines: list.map((e) => ({ x: [e.onset, e.end], y: [e.force_before, e.force_after], cls: series(1), thick: list.length <= 60, name: "slip" })),
    points: [{
      x: list.map((e) => e.onset), y: list.map((e) => e.force_before), cls: series(1), size: list.length > 60 ? 2.5 : 4.5,
      title: (i) => `slip at ${digits(list[i].onset, 6)} s: drop ${withDoubt(list[i].drop, list[i].drop_uncertainty)} in ${digits(list[i].slip_duration, 3)} s`,
    }],
  });
  const trace = (curve, list, marks = []) => {
    const marked = ends(list);
    return { x: { label: "time (s)" }, rows: [{ y: { label: "F/W" }, marks, lines: [{ ...curve, cls: series(5), name: "F/W" }, ...marked.lines], points: marked.points }] };
  };
  const changes = record.regimes.slice(1).map((r) => r.start);
  whole.draw(trace(curves.friction, events, changes), `Force over load with ${count(record.events, "slip event")} marked. ${record.regimes.map((r) => `${r.kind} from ${digits(r.start, 5)} to ${digits(r.end, 5)} s`).join("; ")}.`);
  const figures = [whole];
  if (curves.close) {
    const near = events.filter((e) => e.end >= curves.close.x[0] && e.onset <= curves.close.x.at(-1));
    const close = new Figure({
      name: "close", title: "Some events at close range", height: 300,
      columns: () => ({ time: curves.close.x, "F/W": curves.close.y }),
      caption: "The force rises while the slider sticks, and falls when it slips: the marks are onset and end of each slip.",
    });
    close.draw(trace(curves.close, near), `${count(near.length, "event")} with onsets and ends.`);
    figures.push(close);
  }
  const timed = events.filter((e) => e.stick_duration !== null);
  if (timed.length) {
    const times = timed.map((e) => e.stick_duration);
    const drops = new Figure({
      name: "drops", title: "Drop against stick time", height: 300,
      columns: () => ({ stick_time: times, drop: timed.map((e) => e.drop), drop_uncertainty: timed.map((e) => e.drop_uncertainty) }),
      caption: "Within one recording a larger drop follows a longer stick without any healing, as friction varies along the track; recordings at several velocities separate healing from it.",
    });
    const range = [Math.min(...times) / 1.3, Math.max(...times) * 1.3];
    figures.push(drops);
    drops.draw({
      x: { label: "stick time (s)", log: true, range },
      rows: [{
        y: { label: "drop of F/W", range: [0, 1.08 * Math.max(...timed.map((e) => e.drop))] },
        lines: [{ x: range, y: [record.smallest_drop, record.smallest_drop], cls: "s6", dashed: true, name: "smallest detectable drop" }],
        points: [{
          x: times, y: timed.map((e) => e.drop), cls: series(0), size: timed.length > 300 ? 2 : 3.5,
          title: (i) => `slip at ${digits(timed[i].onset, 6)} s: drop ${withDoubt(timed[i].drop, timed[i].drop_uncertainty)} after ${digits(times[i], 3)} s of stick`,
        }],
      }],
    }, `Drops from ${digits(Math.min(...timed.map((e) => e.drop)), 2)} to ${digits(Math.max(...timed.map((e) => e.drop)), 2)}. Dashed: the smallest detectable drop.`);
  }
  return figures;
}

/** Events with their numbers; the CSV has all. */
export function catalogue(record, name) {
  const events = record.catalogue.slice(0, MOST);
  if (!events.length) return el("p", { class: "note" }, "No slip event: there is no catalogue.");
  const shown = COLUMNS.filter(([n]) => events.some((e) => e[n] !== null));
  const cell = (event, n, factor = 1) => (event[n] === null ? "–" : factor === 1 ? withDoubt(event[n], event[`${n}_uncertainty`] ?? (n === "onset" ? event.timing_uncertainty : null)) : digits(factor * event[n], 4));
  const save = () => {
    const columns = Object.entries(record.units).map(([n, unit]) => [unit === "1" ? n : `${n} (${unit})`, record.catalogue.map((e) => e[n])]);
    saveFile(`${name}-events.csv`, csv({ ...Object.fromEntries(columns), regime: record.catalogue.map((e) => e.regime) }), "text/csv");
  };
  return el("div", { class: "catalogue" },
    el("div", { class: "actions" }, el("h4", {}, "Catalogue of events"), el("button", { type: "button", click: save }, "Catalogue as CSV")),
    table(["", ...shown.map(([, label]) => label)], events.map((e, i) => [String(i + 1), ...shown.map(([n, , factor]) => cell(e, n, factor))]), `Catalogue of events of ${name}`, true),
    record.catalogue.length > MOST && el("p", { class: "note" }, `The first ${MOST} of ${record.catalogue.length} events; the CSV has all.`));
}
