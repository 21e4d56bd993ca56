// Requests to the server that the page came from.

import { capital } from "./words.js";

/** A request that the server refuses; the message is the server's sentence. */
export class Refused extends Error {}

/** Report a refusal as a sentence; any other error is a defect of the page. */
function refuse(error, report) {
  if (!(error instanceof Refused)) throw error;
  report(capital(error.message));
}

/** What the network gives, or a sentence where it gives nothing. */
async function received(promise) {
  try {
    return await promise;
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Refused("The server does not answer; is asperity serve still running?");
  }
}

async function send(path, body, signal) {
  const response = await received(fetch(`/api/${path}`, {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify(body),
    signal,
  }));
  if (!response.ok) {
    const body = await response.json().catch(() => ({}));
    throw new Refused(body.error || `The server answered with ${response.status}.`);
  }
  return response;
}

/** JSON of a GET request. */
export async function get(path) {
  return received(fetch(`/api/${path}`).then((response) => response.json()));
}

/** JSON answer to a POST request. */
async function ask(path, body, signal) {
  return received((await send(path, body, signal)).json());
}

/**
 * Run a job: `onMessage` is called with each of its messages, and the last message is returned.
 * Aborting the signal ends the job.
 */
async function run(path, body, onMessage, signal) {
  const response = await send(path, body, signal);
  const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
  let begun = "";
  let last = {};
  for (;;) {
    const { done, value } = await received(reader.read());
    if (done) {
      if (!last.done && !signal?.aborted) throw new Refused("The server ended before the computation did; is asperity serve still running?");
      return last;
    }
    const lines = (begun + value).split("\n");
    begun = lines.pop();
    for (const line of lines) {
      last = JSON.parse(line);
      if (last.error && !last.cancelled) throw new Refused(last.error);
      onMessage(last);
    }
  }
}

/** Send a file; `onProgress` is called with the share that has gone out. */
function sendFile(path, file, onProgress, signal) {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open("POST", `/api/${path}`);
    request.setRequestHeader("Content-Type", "application/octet-stream");
    request.setRequestHeader("X-File-Name", encodeURIComponent(file.name));
    request.responseType = "json";
    request.upload.addEventListener("progress", (event) => onProgress(event.loaded / event.total));
    request.addEventListener("load", () => {
      if (request.status === 200) resolve(request.response);
      else reject(new Refused(request.response?.error || `The server answered with ${request.status}.`));
    });
    request.addEventListener("error", () => reject(new Refused("The server did not take the file; is it too large, or has asperity serve ended?")));
    request.addEventListener("abort", () => reject(new DOMException("", "AbortError")));
    signal.addEventListener("abort", () => request.abort());
    request.send(file);
  });
}

/**
 * Requests of which only the newest counts: a new request, or `stop`, ends the one before.
 *
 * `onRefused` is called with the sentence of a server that refuses. Each request gives null where it was
 * refused or ended.
 */
export class Work {
  constructor(onRefused) {
    this.onRefused = onRefused;
    this.current = null;
  }

  /** JSON answer to a question. */
  ask(path, body) {
    return this.#newest((signal) => ask(path, body, signal));
  }

  /** Result of a job; `onMessage` is called with each of its messages. */
  async run(path, body, onMessage = () => {}) {
    const last = await this.#newest((signal) => run(path, body, (part) => { if (!signal.aborted) onMessage(part); }, signal));
    return last?.result ?? null;
  }

  /** Send a file; `onProgress` is called with the share that has gone out. */
  send(path, file, onProgress) {
    return this.#newest((signal) => sendFile(path, file, onProgress, signal));
  }

  stop() {
    this.current?.abort();
    this.current = null;
  }

  async #newest(request) {
    this.stop();
    const here = new AbortController();
    this.current = here;
    try {
      const answer = await request(here.signal);
      return here.signal.aborted ? null : answer;
    } catch (error) {
      if (error.name !== "AbortError") refuse(error, this.onRefused);
      return null;
    } finally {
      if (this.current === here) this.current = null;
    }
  }
}

/**
 * Asks for the newest question only: while an answer is on its way, later questions replace each
 * other, and the last is sent next. `onRefused` is called as that of `Work`.
 */
export class Latest {
  constructor(path, onAnswer, onRefused) {
    this.path = path;
    this.onAnswer = onAnswer;
    this.onRefused = onRefused;
    this.busy = false;
    this.pending = null;
  }

  ask(body, extra) {
    this.pending = { body, extra };
    if (!this.busy) this.#next();
  }

  async #next() {
    this.busy = true;
    while (this.pending) {
      const { body, extra } = this.pending;
      this.pending = null;
      try {
        await this.onAnswer(await ask(this.path, body), extra, this.pending !== null);
      } catch (error) {
        refuse(error, this.onRefused);
      }
    }
    this.busy = false;
  }
}
