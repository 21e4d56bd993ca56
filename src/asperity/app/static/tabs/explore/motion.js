// The motion in time: computed once the sliders rest, and drawn while it is computed.

import { Figure, series } from "../../lib/charts.js";
import { Refused, run } from "../../lib/server.js";
import { digits, quantity } from "../../lib/units.js";

/** Time (ms) without a movement of a slider after which the motion is computed. */
const REST = 600;

export class MotionPanel {
  /** `onMotion(motion)` is called with the motion so far, and with null when it is out of date. */
  constructor(onMotion) {
    this.onMotion = onMotion;
    this.figure = new Figure({
      name: "motion", title: "Motion in time", height: 320,
      columns: () => this.motion && {
        time: this.motion.curves.force.x, force: this.motion.curves.force.y,
        time_of_displacement: this.motion.curves.displacement.x, displacement: this.motion.curves.displacement.y,
        time_of_velocity: this.motion.curves.velocity.x, velocity: this.motion.curves.velocity.y,
      },
      caption: "Integrated in time from steady sliding at 0.7 V. Dashed: the pulled end of the spring. A displacement along it is sliding; a staircase is stick-slip.",
    });
    this.element = this.figure.element;
  }

  /** Forget the motion: its numbers have changed. */
  stop() {
    clearTimeout(this.resting);
    this.work?.abort();
    this.motion = null;
    this.onMotion(null);
    this.element.classList.add("waiting");
  }

  /** Compute the motion of an operating point once its numbers have rested. */
  ask(question, point) {
    clearTimeout(this.resting);
    this.resting = setTimeout(() => this.#compute(question, point), REST);
  }

  async #compute(question, point) {
    this.work?.abort();
    this.work = new AbortController();
    const { signal } = this.work;
    const { laws, ...asked } = question;
    this.figure.note.textContent = "Integrating the motion…";
    try {
      const last = await run("explore/motion", { ...asked, growth_rate: point.converged ? point.growth_rate : null }, (part) => {
        if (!signal.aborted && part.curves) this.#draw(part, question, point, false);
      }, signal);
      if (!signal.aborted && last.result) this.#draw(last.result, question, point, true);
    } catch (error) {
      if (error.name === "AbortError") return;
      if (!(error instanceof Refused)) throw error;
      this.figure.note.textContent = error.message;
    }
  }

  #draw(motion, question, point, done) {
    this.motion = motion;
    this.element.classList.remove("waiting");
    const { force, displacement } = motion.curves;
    const [unit, factor] = displacement.y.at(-1) > 1e-3 ? ["mm", 1e3] : ["µm", 1e6];
    const sentence = sentenceOf(motion, point, done);
    this.figure.note.textContent = sentence;
    this.figure.draw({
      x: { label: "time (s)", range: [0, motion.reached] },
      rows: [
        { y: { label: "F/W₀" }, lines: [{ ...force, cls: series(0), name: "F/W₀" }] },
        {
          y: { label: `displacement (${unit})` },
          lines: [
            { x: [0, motion.reached], y: [0, factor * motion.V * motion.reached], cls: "s6", dashed: true, name: "of the pulled end" },
            { x: displacement.x, y: displacement.y.map((v) => factor * v), cls: series(1), thick: true, name: "displacement of the slider" },
          ],
        },
      ],
    }, sentence);
    this.onMotion(motion);
  }
}

function sentenceOf(motion, point, done) {
  const slip = motion.stick_slip;
  const mass = motion.inertia ? ", with the mass of the slider" : "";
  const until = `${digits(motion.reached, 3)} s computed${mass}${done ? "" : " so far"}`;
  if (motion.stopped) return `The motion ends: ${motion.stopped} (${until}).`;
  if (slip) return `Stick-slip: the slider rests, and slips by ${quantity(slip.slip, "length", 3)} once in ${digits(slip.period, 3)} s; the force rises and drops by ${digits(slip.drop, 3)} W₀ (${until}).`;
  if (point.converged && point.stable) return `Steady: the slider settles to the same motion in each period of the load (${until}).`;
  if (!done) return `Sliding is unstable: waiting for the slips (${until}).`;
  return `Sliding is unstable, and no two slips follow each other in the ${until}.`;
}
