// Figure 10: the interface as a spring in series with a frictional joint, with its numbers.

import { el, shape } from "../../lib/dom.js";
import { scrolling } from "../../lib/tables.js";
import { digits, quantity } from "../../lib/units.js";

/** A spring between two points of a horizontal line, of so many teeth. */
function spring(from, to, y, teeth) {
  const step = (to - from) / (teeth + 2);
  let path = `M${from} ${y}h${step}`;
  for (let i = 0; i < teeth; i += 1) path += `l${step / 4} -9l${step / 2} 18l${step / 4} -9`;
  return shape("path", { class: "stroke", d: `${path}H${to}` });
}

/** The drawing, with the stiffnesses and the resonance that `numbers` has in SI. */
export function elementDrawing({ asperities, spring: pulling, ratio, resonance }) {
  const label = (x, y, text, cls = "") => shape("text", { x, y, class: cls, "text-anchor": "middle" }, text);
  const description = `A wall, a frictional joint, a spring of ${quantity(asperities, "stiffness", 3)} for the asperities, the slider, and a pulling spring of ${quantity(pulling, "stiffness", 3)}.`;
  const svg = shape("svg", { viewBox: "0 0 640 130", role: "img", "aria-label": description });
  svg.append(
    shape("path", { class: "stroke", d: "M20 20V100M20 35l-10 10M20 55l-10 10M20 75l-10 10M20 60H90" }),
    shape("rect", { class: "solid", x: 90, y: 44, width: 90, height: 12 }),
    shape("rect", { class: "solid", x: 110, y: 64, width: 90, height: 12 }),
    shape("path", { class: "stroke", d: "M90 60V44M200 64V60H220" }),
    spring(220, 350, 60, 6),
    shape("rect", { class: "solid", x: 350, y: 30, width: 90, height: 60 }),
    spring(440, 590, 60, 6),
    shape("path", { class: "stroke", d: "M590 60h30m-9 -6l9 6l-9 6M395 4v24m-6 -9l6 9l6 -9" }),
    label(145, 32, "joint"), label(145, 98, "plastic rate"),
    label(285, 36, "asperities"), label(285, 98, `W/λ = ${quantity(asperities, "stiffness", 3)}`),
    label(395, 66, "slider", "on"), label(412, 16, "W"),
    label(515, 36, "pulling spring"), label(515, 98, `K = ${quantity(pulling, "stiffness", 3)}`), label(605, 50, "V"),
  );
  return el("figure", { class: "panel", "aria-label": "The element" },
    scrolling("Drawing of the element", [svg]),
    el("p", { class: "note" }, `λK/W₀ = ${digits(ratio, 3)}: while the joint sticks, the slider follows ${digits((100 * ratio) / (1 + ratio), 3)} % of the movement of the pulling end, and the pulling spring takes up the remainder. On its asperities the slider resonates at ${quantity(resonance, "frequency", 3)}. Redrawn from the text, with what the element does over one period at ε_eff = 0.24.`));
}
