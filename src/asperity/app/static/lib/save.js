// Files and texts that leave the page.

import { el } from "./dom.js";
import { flushLink } from "./link.js";
import { Work } from "./server.js";

/** Offer a file. */
export function saveFile(name, content, type) {
  const url = content instanceof Blob ? URL.createObjectURL(content) : URL.createObjectURL(new Blob([content], { type }));
  const link = document.createElement("a");
  link.href = url;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}

/** Columns of numbers and texts as CSV; a number is written with all its digits. */
export function csv(columns) {
  const names = Object.keys(columns);
  const length = Math.max(...names.map((n) => columns[n].length));
  const cell = (value) => {
    if (value === null || value === undefined) return "";
    const text = String(value);
    return /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
  };
  const rows = Array.from({ length }, (_, i) => names.map((n) => cell(columns[n][i])).join(","));
  return [names.map(cell).join(","), ...rows].join("\n") + "\n";
}

/** Offer rows, records of numbers and texts, as a file of CSV; by default with the columns that any row has. */
export function saveRows(name, rows, columns = [...new Set(rows.flatMap(Object.keys))]) {
  saveFile(name, csv(Object.fromEntries(columns.map((n) => [n, rows.map((row) => row[n])]))), "text/csv");
}

/** Buttons that copy: a label, and a function that returns the text or a promise of it. */
export function copies(...labelled) {
  return labelled.map(([label, text]) => el("button", {
    type: "button",
    click: async ({ currentTarget }) => {
      const copied = await text();
      if (copied) copyText(copied, currentTarget);
    },
  }, label));
}

/** Copies a question as Python and as a command, as the server writes them. */
export function textsOf(path, question, refused) {
  const asking = new Work(refused);
  const as = (kind) => async () => (await asking.ask(path, question()))?.[kind];
  return [["Copy as Python", as("python")], ["Copy as command", as("command")]];
}

/** Copies the address of the view. */
export const copyLink = ["Copy link", () => { flushLink(); return location.href; }];

async function copyText(text, button) {
  const label = button.textContent;
  try {
    await navigator.clipboard.writeText(text);
    button.textContent = "Copied";
  } catch {
    const area = document.createElement("textarea");
    area.value = text;
    document.body.append(area);
    area.select();
    const done = document.execCommand("copy");
    area.remove();
    button.textContent = done ? "Copied" : "Select and copy";
    button.focus();
  }
  setTimeout(() => { button.textContent = label; }, 1500);
}
