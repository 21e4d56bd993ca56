// A drawing of slider and spring that moves as the computed orbit does, or as stick-slip in time.

import { el, shape } from "../../lib/dom.js";

/** Duration (s) of one period on the screen: the true period is too short to be seen. */
const SHOWN_PERIOD = 4;
/** Duration (s) of one cycle of stick-slip on the screen. */
const SHOWN_CYCLE = 3;
/** Length (px) of the load's arrow at the mean load, and of the spring at the mean force. */
const ARROW = 46, SPRING = 150;
/** Place of the block (px): its left edge when it is where the mean motion has it. */
const BLOCK = { x: 120, width: 110, height: 54, floor: 150 };
/** Largest excursion (px) of the block from the mean motion. */
const SWING = 34;

/** Zigzag of a spring from x to x + length. */
function coil(x, y, length) {
  const turns = 9;
  const step = (length - 20) / turns;
  const points = [[x, y], [x + 10, y]];
  for (let i = 0; i < turns; i += 1) points.push([x + 10 + (i + 0.5) * step, y + (i % 2 ? 9 : -9)]);
  points.push([x + length - 10, y], [x + length, y]);
  return points.map(([a, b]) => `${a.toFixed(1)},${b.toFixed(1)}`).join(" ");
}

export class Machine {
  constructor() {
    const { x, width, height, floor } = BLOCK;
    this.ground = shape("g", { class: "ground" });
    for (let i = -1; i < 30; i += 1) {
      this.ground.append(shape("line", { x1: i * 20, y1: floor + 14, x2: i * 20 + 12, y2: floor }));
    }
    this.block = shape("rect", { class: "block", x, y: floor - height, width, height, rx: 4 });
    this.shaft = shape("line", { class: "load" });
    this.head = shape("polygon", { class: "load" });
    this.spring = shape("polyline", { class: "spring", fill: "none" });
    this.hand = shape("circle", { class: "hand", r: 5 });
    this.label = shape("text", { class: "hand-label", "text-anchor": "middle" }, "pulled at V");
    this.load = shape("text", { class: "load-label", "text-anchor": "start" }, "W");
    this.picture = shape("svg", { viewBox: "0 0 460 180", role: "img", "aria-label": "Slider, load and spring" },
      shape("line", { class: "track", x1: 0, x2: 460, y1: floor, y2: floor }), this.ground,
      this.block, this.shaft, this.head, this.load, this.spring, this.hand, this.label);
    this.note = el("p", { class: "note" });
    this.button = el("button", { type: "button", class: "quiet small", click: () => this.#play(!this.playing) });
    this.element = el("figure", { class: "panel machine" },
      el("figcaption", {}, el("h3", {}, "The slider"), this.button), this.picture, this.note);
    this.phase = 0;
    this.playing = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.#play(this.playing);
    // Nothing is drawn while the panel is out of sight.
    new IntersectionObserver(([entry]) => { this.seen = entry.isIntersecting; this.#next(); }).observe(this.element);
  }

  /** Show an orbit: the phases of a period with slip velocity over V, force and load over W0. */
  show(point, epsilon) {
    if (!point.converged) {
      this.orbit = null;
      this.#begin();
      return;
    }
    const n = point.phase.length;
    // Position against the mean motion: the integral of slip velocity less V.
    const place = [0];
    for (let i = 1; i < n; i += 1) {
      place.push(place[i - 1] + ((point.slip[i] + point.slip[i - 1]) / 2 - 1) / n);
    }
    const middle = place.reduce((a, b) => a + b, 0) / n;
    const swing = Math.max(...place.map((v) => Math.abs(v - middle)), 1e-12);
    const mean = point.force.reduce((a, b) => a + b, 0) / n;
    const pull = Math.max(...point.force.map((f) => Math.abs(f - mean)), 1e-12);
    const most = Math.max(...point.slip);
    this.orbit = {
      n, seconds: SHOWN_PERIOD, ground: 40, epsilon,
      place: place.map((v) => (v - middle) / swing), pull: point.force.map((f) => (f - mean) / pull),
      note: "One period of the load in four seconds; excursions of the block and of the spring are enlarged. "
        + (most > 2
          ? `The slider ${Math.min(...point.slip) < 0.1 ? "nearly stops under high load and " : ""}slips at ${most.toPrecision(2)} V when the load is low.`
          : "The slider moves nearly evenly."),
    };
    this.#begin();
  }

  /** Follow a motion in time where it is stick-slip; null, or a motion without, is the orbit again. */
  follow(motion) {
    const frames = motion?.frames;
    if (!frames && !this.stickSlip) return;
    this.stickSlip = frames ? this.#sequence(frames) : null;
    this.#begin();
  }

  #sequence({ duration, travel, place, force }) {
    const swing = Math.max(...place.map(Math.abs));
    const [low, high] = [Math.min(...force), Math.max(...force)];
    return {
      n: place.length, seconds: SHOWN_CYCLE, ground: (SWING * travel) / swing, epsilon: 0,
      place: place.map((v) => v / swing), pull: force.map((f) => (2 * f - low - high) / (high - low)),
      note: `Stick-slip: the last cycle, of ${duration.toPrecision(3)} s, shown in ${SHOWN_CYCLE} s. The block sticks while the spring is stretched, then it slips.`,
    };
  }

  #begin() {
    this.shown = this.stickSlip || this.orbit;
    this.element.hidden = !this.shown;
    if (!this.shown) return;
    this.note.textContent = this.shown.note;
    this.#draw();
    this.#next();
  }

  #play(on) {
    this.playing = on;
    this.button.textContent = on ? "Pause" : "Play";
    this.button.setAttribute("aria-label", on ? "Pause the moving slider" : "Play the moving slider");
    this.#next();
  }

  #next() {
    if (!this.playing || !this.seen || !this.shown || this.waiting) return;
    this.waiting = true;
    requestAnimationFrame((now) => {
      this.waiting = false;
      // A pause of the page is no jump of the slider.
      const passed = Math.min(now - (this.last ?? now), 100) / 1000;
      this.last = now;
      this.phase += passed / this.shown.seconds;
      if (this.element.isConnected) this.#draw();
      this.#next();
    });
  }

  #draw() {
    const { n, epsilon, ground, pull, place } = this.shown;
    const turn = this.phase % 1;
    const i = Math.min(n - 1, Math.floor(turn * n));
    const { x, width, height, floor } = BLOCK;
    const left = x + SWING * place[i];
    const load = 1 + epsilon * Math.cos(2 * Math.PI * turn);
    this.block.setAttribute("x", left);
    // The track runs under the mean motion.
    this.ground.setAttribute("transform", `translate(${-(this.phase * ground) % 20} 0)`);
    const [top, middle] = [floor - height, left + width / 2];
    const tail = top - 8 - ARROW * load;
    for (const [name, value] of [["x1", middle], ["x2", middle], ["y1", tail], ["y2", top - 12]]) this.shaft.setAttribute(name, value);
    this.head.setAttribute("points", `${middle - 6},${top - 13} ${middle + 6},${top - 13} ${middle},${top - 2}`);
    this.load.setAttribute("x", middle + 10);
    this.load.setAttribute("y", tail + 12);
    const length = SPRING + 24 * pull[i];
    this.spring.setAttribute("points", coil(left + width, floor - height / 2, length));
    this.hand.setAttribute("cx", left + width + length);
    this.hand.setAttribute("cy", floor - height / 2);
    this.label.setAttribute("x", left + width + length);
    this.label.setAttribute("y", floor - height / 2 - 16);
  }
}
