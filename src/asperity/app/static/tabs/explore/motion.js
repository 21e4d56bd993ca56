// The motion in time: computed after the last change of a slider, and drawn while it is computed.

import { Figure, series } from "../../lib/charts.js";
import { Work } from "../../lib/server.js";
import { digits, quantity } from "../../lib/units.js";
import { ended, worded } from "../../lib/words.js";

/** Time (ms) without a movement of a control after which the motion is computed. */
const PAUSE = 600;

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
      caption: "Integrated in time, with the mass of the slider, from steady sliding at 0.7 V. Dashed: the pulled end of the spring. A displacement along it is sliding; a staircase is stick-slip.",
    });
    this.element = this.figure.element;
    this.work = new Work((sentence) => { this.figure.note.textContent = ended(sentence); });
  }

  /** Forget the motion, whose numbers have changed. */
  stop() {
    clearTimeout(this.timer);
    this.work.stop();
    this.motion = null;
    this.onMotion(null);
    this.element.classList.add("waiting");
  }

  /** Compute the motion of an operating point a moment after its last change. */
  ask(question, point) {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.#compute(question, point), PAUSE);
  }

  async #compute(question, point) {
    const { laws, ...operating } = question;
    this.figure.note.textContent = "Integrating the motion in time; the equations of a law are compiled first, once, which takes some seconds.";
    const motion = await this.work.run("explore/motion", { ...operating, growth_rate: point.converged ? point.growth_rate : null }, (part) => {
      if (part.curves) this.#draw(part, point, false);
    });
    if (motion) this.#draw(motion, point, true);
  }

  #draw(motion, point, done) {
    this.motion = motion;
    this.element.classList.remove("waiting");
    const { force, displacement } = motion.curves;
    const [unit, factor] = displacement.y.at(-1) > 1e-3 ? ["mm", 1e3] : ["µm", 1e6];
    const sentence = worded(sentenceOf(motion, point, done));
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
  const until = `${digits(motion.reached, 3)} s computed${motion.inertia ? "" : ", without mass"}${done ? "" : " so far"}`;
  if (motion.stopped) return `The motion ends: ${motion.stopped} (${until}).`;
  if (slip) return `Stick-slip: the slider sticks, and slips by ${quantity(slip.slip, "length", 3)} every ${digits(slip.period, 3)} s; the force rises and drops by ${digits(slip.drop, 3)} W₀ (${until}).`;
  if (point.converged && point.stable) {
    // A disturbance fades to 5 % in ln 20 relaxation times.
    const fading = -Math.log(20) / point.growth_rate;
    if (motion.reached < fading) return `Still settling: a disturbance fades to 5 % in ${digits(fading, 3)} s, and then the motion is the same in each period of the load (${until}).`;
    return `Settled: the motion is the same in each period of the load (${until}).`;
  }
  if (!done) return `Sliding is unstable: waiting for the slips (${until}).`;
  return `Sliding is unstable, but shows no repeated slips in the ${until}.`;
}
