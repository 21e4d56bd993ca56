// Sliders with number fields.

import { el, formula, fresh } from "./dom.js";
import { parse, quantity } from "./units.js";

const STEPS = 400;

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
    this.field = el("input", {
      type: "text", class: "number", spellcheck: "false", autocomplete: "off", inputmode: "text",
      "aria-label": `${parameter.meaning}, with its unit`,
      change: () => this.#written(),
      keydown: (event) => { if (event.key === "Enter") this.#written(); },
    });
    this.element = el(
      "div", { class: "quantity" },
      el("label", { for: id, title: parameter.meaning },
        parameter.symbol ? formula(parameter.symbol) : parameter.name,
        el("span", { class: "meaning" }, parameter.meaning)),
      this.field, this.range,
    );
    this.set(slider.value);
  }

  /** Show a value in SI without telling anyone. */
  set(value) {
    this.value = value;
    this.field.value = typeof value === "number" ? quantity(value, this.parameter.kind, 4) : value;
    this.field.removeAttribute("aria-invalid");
    if (typeof value !== "number") return;
    this.range.value = Math.round(STEPS * this.#fraction(value));
    this.range.setAttribute("aria-valuetext", this.field.value);
  }

  #fraction(value) {
    const { low, high, log } = this.slider;
    const found = log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
    return Math.min(1, Math.max(0, found));
  }

  #moved() {
    const { low, high, log } = this.slider;
    const u = Number(this.range.value) / STEPS;
    const exact = log ? low * (high / low) ** u : low + (high - low) * u;
    // Three digits: a value that can be read, written down and said.
    this.set(Number(exact.toPrecision(3)));
    this.onInput(this.value);
  }

  #written() {
    const value = parse(this.field.value, this.parameter.kind) ?? this.field.value.trim();
    if (value === this.value) return;
    this.set(value);
    this.onInput(value);
  }
}

/** A field for a number, without a slider. */
export class Entry {
  constructor({ parameter, value, onInput, label }) {
    this.parameter = parameter;
    const id = fresh("entry");
    const text = (v) => (typeof v === "number" ? quantity(v, parameter.kind, 4) : v);
    const field = el("input", {
      type: "text", class: "number", id, spellcheck: "false", autocomplete: "off",
      "aria-label": label ? parameter.meaning : false,
      change: () => {
        const found = parse(field.value, parameter.kind) ?? field.value.trim();
        field.value = text(found);
        onInput(found);
      },
    });
    field.value = text(value);
    this.element = el("div", { class: "entry" },
      el("label", { for: id, title: parameter.meaning },
        label || [parameter.symbol ? formula(parameter.symbol) : parameter.name, el("span", { class: "meaning" }, parameter.meaning)]),
      field);
  }
}

/** A box to tick. */
export function tick(label, checked, onInput, title) {
  const id = fresh("tick");
  const box = el("input", { type: "checkbox", id, change: () => onInput(box.checked) });
  box.checked = checked;
  const element = el("div", { class: "tick", title }, box, el("label", { for: id }, label));
  return { element, set: (value) => { box.checked = value; }, box };
}

/** A choice of one. */
export function choice(label, options, value, onInput) {
  const id = fresh("choice");
  const select = el("select", { id, change: () => onInput(select.value) },
    options.map(([name, text]) => el("option", { value: name }, text)));
  select.value = value;
  return {
    element: el("div", { class: "choice" }, el("label", { for: id }, label), select),
    set: (chosen) => { select.value = chosen; },
  };
}

/** A group of controls that can be folded; on narrow screens only the first are open. */
export function group(label, always, ...children) {
  const open = always || matchMedia("(min-width: 60.01rem)").matches;
  return el("details", { class: "group", open }, el("summary", {}, label), el("div", { class: "fields" }, ...children));
}
