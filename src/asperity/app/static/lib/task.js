// A long computation as the page shows it: its state in words, a bar, a button that cancels it, and why
// the server refused it.

import { el } from "./dom.js";
import { Work } from "./server.js";

export class Task {
  /**
   * `label` names the bar. `onEnd()` is called when the computation ends, for any reason, and
   * `onRefused(why)` when the server refuses it.
   */
  constructor(label, { statusClass = "sentence", onEnd = () => {}, onRefused = (why) => this.end("", why) } = {}) {
    this.onEnd = onEnd;
    this.status = el("p", { class: statusClass, role: "status" });
    this.bar = el("progress", { max: 1, "aria-label": label, hidden: true });
    this.message = el("p", { class: "message", role: "alert" });
    this.cancel = el("button", { type: "button", hidden: true, click: () => this.end("Cancelled.") }, "Cancel");
    this.work = new Work(onRefused);
  }

  /** Show that a computation begins whose share of work is not known yet. */
  begin(status) {
    this.status.textContent = status;
    this.message.textContent = "";
    this.bar.removeAttribute("value");
    this.bar.hidden = false;
    this.cancel.hidden = false;
  }

  /** Run a job, as `Work.run`. */
  run(path, question, onMessage) {
    return this.work.run(path, question, onMessage);
  }

  /** Stop the computation, if it runs; its last words stay. */
  stop() {
    this.work.stop();
    this.bar.hidden = true;
    this.cancel.hidden = true;
    this.onEnd();
  }

  /** Stop the computation: its state, and why it was refused. */
  end(status, message = "") {
    this.stop();
    this.status.textContent = status;
    this.message.textContent = message;
  }
}
