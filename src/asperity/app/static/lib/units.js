// Numbers as people write them: the server's kinds of quantity give the units.

let kinds = {};

/** Take the kinds of quantity from the catalogue. */
export function useKinds(known) {
  kinds = known;
}

const pretty = (unit) => unit.replace(/^u(?=[A-Za-z])/, "µ").replace("N*s/m", "N s/m").replace("/um", "/µm").replace("^2", "²");
const plain = (unit) => unit.replaceAll("µ", "u").replaceAll("μ", "u").replaceAll(" ", "").replace("²", "^2");

/** A number with so many significant digits, without trailing zeros. */
export function digits(value, count = 4) {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) {
    const [mantissa, power] = value.toExponential(count - 1).split("e");
    const times = Number(mantissa) === 1 ? "" : `${String(Number(mantissa)).replace("-", "−")}·`;
    return `${times}10${superscript(Number(power))}`;
  }
  return String(Number(value.toPrecision(count))).replace("-", "−");
}

function superscript(power) {
  const figures = "⁰¹²³⁴⁵⁶⁷⁸⁹";
  return (power < 0 ? "⁻" : "") + String(Math.abs(power)).replace(/\d/g, (d) => figures[d]);
}

/** The unit in which a value reads best, and its power of ten. */
function rung(value, kind) {
  const { ladder, si } = kinds[kind];
  const size = Math.abs(value) * (1 + 1e-9);
  if (!size) return [pretty(si), ladder.some(([u]) => u === si) ? 0 : ladder[0][1]];
  const fitting = ladder.filter(([, power]) => size >= 10 ** power);
  const [unit, power] = fitting.length ? fitting[fitting.length - 1] : ladder[0];
  return [pretty(unit), power];
}

/** A value in SI with the unit that reads best. */
export function quantity(value, kind, count = 4) {
  const [unit, power] = rung(value, kind);
  const text = power ? digits(Number((value / 10 ** power).toPrecision(15)), count) : digits(value, count);
  return unit ? `${text} ${unit}` : text;
}

/** SI value of a text, or null where only the server may know its unit. */
export function parse(text, kind) {
  // Three digits after a comma may be thousands, which the server refuses in words.
  if (/(?<!\d)[1-9]\d{0,2},\d{3}(?!\d)/.test(text)) return null;
  const match = /^\s*([-+−]?[\d.]+(?:[eE][-+]?\d+)?)\s*(.*)$/.exec(text.replace(",", "."));
  if (!match) return null;
  const number = Number(match[1].replace("−", "-"));
  if (!Number.isFinite(number)) return null;
  const unit = plain(match[2]);
  const { ladder } = kinds[kind];
  if (kind === "dimensionless") {
    if (unit === "%") return number / 100;
    return unit ? null : number;
  }
  const step = ladder.find(([name]) => plain(name) === unit);
  // Divided, so that 1 um is the double 1e-6.
  if (!step) return null;
  return step[1] < 0 ? number / 10 ** -step[1] : number * 10 ** step[1];
}

/** A number of the address in SI, or its text where it has a unit. */
export function written(text) {
  return text !== "" && Number.isFinite(Number(text)) ? Number(text) : text;
}

/** A value with the digits that its standard uncertainty leaves. */
export function withDoubt(value, doubt) {
  if (!Number.isFinite(value)) return "–";
  if (!doubt || !Number.isFinite(doubt)) return digits(value, 5);
  const places = Math.max(0, Math.min(12, 1 - Math.floor(Math.log10(doubt))));
  if (places > 7 || Math.abs(value) >= 1e6) {
    const count = Math.floor(Math.log10(Math.abs(value) / doubt)) + 2;
    return `${digits(value, Math.max(2, Math.min(15, count)))} ± ${digits(doubt, 2)}`;
  }
  return `${value.toFixed(places).replace("-", "−")} ± ${doubt.toFixed(places)}`;
}
