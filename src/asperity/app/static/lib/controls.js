// Sliders with number fields.

import { el, fill, formula, fresh } from "./dom.js";
import { parse, quantity } from "./units.js";
import { nameOf, symbolOf } from "./words.js";

const STEPS = 400;

/** The text of a value in SI, or a text that only the server understands. */
const textOf = (value, { kind }) => (typeof value === "number" ? quantity(value, kind, 4) : value);

/** What is written in a field of a number, in SI if the page knows the unit. */
const valueOf = (field, { kind }) => parse(field.value, kind) ?? field.value.trim();

/** A field for a number, and the label of what has an id: by default symbol and meaning of the parameter. */
function numberField(parameter, id, attributes, label) {
  const symbol = parameter.symbol ? formula(symbolOf(parameter)) : parameter.name;
  return [
    el("label", { for: id, title: parameter.meaning }, label || [symbol, el("span", { class: "meaning" }, parameter.meaning)]),
    el("input", { type: "text", class: "number", spellcheck: "false", autocomplete: "off", ...attributes }),
  ];
}

/**
 * A slider with a field for its number.
 *
 * `onInput(value)` is called with SI values, or with a text that only the server understands.
 */
export class Quantity {
  constructor({ parameter, slider, onInput }) {
    this.parameter = parameter;
    this.slider = slider;
    this.onInput = onInput;
    const id = fresh("quantity");
    this.range = el("input", {
      type: "range", id, min: 0, max: STEPS, step: 1,
      input: () => this.#moved(),
    });
    const [label, field] = numberField(parameter, id, {
      "aria-label": `${parameter.meaning}, with its unit`, change: () => this.#written(),
    });
    this.field = field;
    this.element = el("div", { class: "quantity" }, label, field, this.range);
    this.set(slider.value);
  }

  /** Show a value in SI without calling `onInput`. */
  set(value) {
    this.value = value;
    this.field.value = textOf(value, this.parameter);
    if (typeof value !== "number") return;
    this.range.value = Math.round(STEPS * this.#fraction(value));
    this.range.setAttribute("aria-valuetext", this.field.value);
    this.onShown?.();
  }

  /** Move the slider to a step, as the mouse does. */
  slideTo(step) {
    this.range.value = step;
    this.#moved();
  }

  #fraction(value) {
    const { low, high, log } = this.slider;
    const share = log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
    return Math.min(1, Math.max(0, share));
  }

  #moved() {
    const { low, high, log } = this.slider;
    const u = Number(this.range.value) / STEPS;
    const exact = log ? low * (high / low) ** u : low + (high - low) * u;
    // Three digits: a value that can be read and written down.
    this.set(Number(exact.toPrecision(3)));
    this.onInput(this.value);
  }

  #written() {
    const value = valueOf(this.field, this.parameter);
    if (value === this.value) return;
    this.set(value);
    this.onInput(value);
  }
}

/**
 * The slider that was touched last, kept at the foot of a narrow screen while its figures scroll; a
 * list chooses another slider. Wide screens, with the sliders next to the figures, hide it.
 */
export class Dock {
  constructor() {
    this.quantities = [];
    this.list = el("select", { "aria-label": "Number of the slider below", change: () => this.#choose(this.quantities[this.list.selectedIndex]) });
    this.value = el("output", {});
    this.range = el("input", { type: "range", min: 0, max: STEPS, step: 1, input: () => this.chosen.slideTo(this.range.value) });
    this.element = el("div", { class: "dock", role: "group", "aria-label": "A slider next to the figures" }, this.list, this.value, this.range);
  }

  /** Offer the sliders of a form; the number chosen before stays, else `first` is chosen. */
  offer(quantities, first) {
    this.quantities = quantities;
    fill(this.list, quantities.map(({ parameter: p }) => el("option", {}, `${p.label || nameOf(p.name)} – ${p.meaning}`)));
    for (const q of quantities) {
      q.onShown = () => { if (q === this.chosen) this.#show(); };
      q.element.addEventListener("focusin", () => this.#choose(q));
    }
    const named = (name) => quantities.find((q) => q.parameter.name === name);
    this.#choose(named(this.chosen?.parameter.name) || named(first) || quantities[0]);
  }

  #choose(quantity) {
    this.chosen = quantity;
    this.list.selectedIndex = this.quantities.indexOf(quantity);
    this.range.setAttribute("aria-label", `Move the ${quantity.parameter.meaning}`);
    this.#show();
  }

  #show() {
    this.range.value = this.chosen.range.value;
    this.value.textContent = this.chosen.field.value;
    this.range.setAttribute("aria-valuetext", this.chosen.field.value);
  }
}

/** A field for a number, without a slider. */
export function entry({ parameter, value, onInput, label }) {
  const id = fresh("entry");
  const [caption, field] = numberField(parameter, id, {
    id, "aria-label": label ? parameter.meaning : false,
    change: () => {
      const written = valueOf(field, parameter);
      field.value = textOf(written, parameter);
      onInput(written);
    },
  }, label);
  field.value = textOf(value, parameter);
  return el("div", { class: "entry" }, caption, field);
}

/** A box to tick. */
export function tick(label, checked, onInput, title) {
  const id = fresh("tick");
  const box = el("input", { type: "checkbox", id, change: () => onInput(box.checked) });
  box.checked = checked;
  return el("div", { class: "tick", title }, box, el("label", { for: id }, label));
}

/** Numbers that laws need and a material does not have: the values at which their sliders start. */
export function neededNumbers({ materials, laws }, material, names) {
  const { numbers, sliders } = materials[material];
  const needed = names.flatMap((law) => laws[law].required).filter((n) => !numbers[n]);
  return Object.fromEntries(needed.map((n) => [n, sliders[n].value]));
}

/** The box that counts the mass of the slider among the numbers of a view. */
export function inertiaTick(numbers, changed) {
  return tick("With the mass of the slider (inertia)", Boolean(numbers.inertia), (on) => {
    if (on) numbers.inertia = 1;
    else delete numbers.inertia;
    changed();
  });
}

/** A labelled text, taken without blanks around it when it is finished. */
export function textField(label, value, onInput, placeholder = "") {
  const id = fresh("field");
  const field = el("input", {
    type: "text", id, placeholder, spellcheck: "false", autocomplete: "off",
    change: () => onInput(field.value.trim()),
  });
  field.value = value ?? "";
  return el("div", { class: "choice" }, el("label", { for: id }, label), field);
}

/** A labelled list to choose from. */
export function choice(label, options, value, onInput) {
  const id = fresh("choice");
  const select = el("select", { id, change: () => onInput(select.value) },
    options.map(([name, text]) => el("option", { value: name }, text)));
  select.value = value;
  return el("div", { class: "choice" }, el("label", { for: id }, label), select);
}

/** A group of controls that can be folded; on narrow screens only the first are open. */
export function group(label, always, ...children) {
  const open = always || matchMedia("(min-width: 60.01rem)").matches;
  return el("details", { class: "group", open }, el("summary", {}, label), el("div", { class: "fields" }, ...children));
}
