// Data: recordings that are dropped, measured and fitted, and the virtual tribometer.

import { el } from "../lib/dom.js";
import { copies, copyLink } from "../lib/save.js";
import { Work } from "../lib/server.js";
import { FitPanel } from "./data/fit.js";
import { ProtocolPanel } from "./data/protocol.js";
import { RecordingCard } from "./data/recording.js";

export const name = "data";
export const title = "Data";

export function create(page) {
  let known = null;
  const cards = [];
  const message = el("p", { class: "message", role: "alert" });
  const asking = new Work((why) => { message.textContent = why; });
  const list = el("div", { class: "recordings" });
  const choose = el("input", {
    type: "file", multiple: true, id: "data-files", class: "visually-hidden",
    change: () => { add([...choose.files]); choose.value = ""; },
  });
  const drop = el("div", {
    class: "drop",
    dragover: (e) => { e.preventDefault(); drop.classList.add("over"); },
    dragleave: () => drop.classList.remove("over"),
    drop: (e) => { e.preventDefault(); drop.classList.remove("over"); add([...e.dataTransfer.files]); },
  },
    el("p", { class: "drop-title" }, "Drop recordings or lock-in tables here"),
    el("p", { class: "note" }, "CSV and other text, HDF5, MATLAB, TDMS, LOOK; up to 512 MB each. They stay on this machine and are deleted when the server ends."),
    choose, el("label", { for: "data-files", class: "button" }, "Choose files"));

  const fit = new FitPanel(page, { rows: () => cards.flatMap((c) => c.rows()), tables: () => cards.flatMap((c) => c.table() || []), runs: () => cards.flatMap((c) => c.run() || []), changed: link });
  const protocol = new ProtocolPanel(page, { read: (upload) => open(upload), changed: link });
  const element = el("section", { class: "tab data", "aria-label": title },
    el("div", { class: "paper-head" }, el("h2", {}, "Data"),
      copies(copyLink)),
    drop, message, list, fit.element, protocol.element);

  async function add(files) {
    message.textContent = "";
    // Files may be dropped before the server has answered.
    while (!known) await new Promise((done) => { setTimeout(done, 50); });
    for (const file of files) {
      if (file.size > known.largest) {
        message.textContent = `${file.name} must be at most ${Math.floor(known.largest / 1024 ** 2)} MB, got ${Math.ceil(file.size / 1024 ** 2)} MB; cut it first.`;
      } else await newCard({ name: file.name }).send(file);
    }
  }

  function newCard(state) {
    const card = new RecordingCard(page, known, state, {
      changed: () => { fit.refresh(); link(); },
      removed: () => { cards.splice(cards.indexOf(card), 1); card.element.remove(); fit.refresh(); link(); },
    });
    cards.push(card);
    list.append(card.element);
    return card;
  }

  function open(upload) {
    const card = newCard({ key: upload.id, name: upload.name });
    card.measure();
    card.element.scrollIntoView({ block: "start" });
    card.element.focus({ preventScroll: true });
  }

  let written = "";
  function link() {
    const parameters = new URLSearchParams();
    for (const card of cards) if (card.state.key) parameters.append("file", JSON.stringify(card.saved()));
    fit.save(parameters);
    protocol.save(parameters);
    page.setLink(name, parameters);
    written = parameters.toString();
  }

  return {
    element,
    renamed() {
      for (const card of cards) card.renamed();
      fit.renamed();
      link();
    },
    async show(parameters) {
      if (!known) {
        known = await asking.ask("data", {});
        if (!known) return;
        protocol.begin(known.protocols);
      }
      if (written && parameters.toString() === written) return;
      written = parameters.toString();
      while (cards.length) cards.pop().element.remove();
      for (const text of parameters.getAll("file")) {
        try {
          newCard(RecordingCard.restored(text)).measure();
        } catch {
          message.textContent = "The link must name recordings as this page writes them, got another text; drop the files again.";
        }
      }
      fit.restore(parameters);
      protocol.restore(parameters);
      fit.refresh();
    },
  };
}
