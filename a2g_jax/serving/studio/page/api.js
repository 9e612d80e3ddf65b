// Requests to the server, and the states that it sends.

export class Refused extends Error {
  constructor(message, field = "") {
    super(message);
    this.field = field;
  }
}

const LOST = "The studio does not answer; is 'a2g studio' still running in its terminal?";

function reason(status, text) {
  try {
    const found = JSON.parse(text);
    return new Refused(found.message || found.error || text, found.field);
  } catch { return new Refused(text || `The server answered ${status}.`); }
}

async function call(method, path, body) {
  let answer;
  try {
    answer = await fetch(path, { method, body: body === undefined ? undefined : JSON.stringify(body), headers: body === undefined ? {} : { "content-type": "application/json" } });
  } catch { throw new Refused(LOST); }
  const text = await answer.text();
  if (!answer.ok) throw reason(answer.status, text);
  return text ? JSON.parse(text) : null;
}

export const get = (path) => call("GET", path);
export const post = (path, body) => call("POST", path, body);
export const remove = (path) => call("DELETE", path);

const limits = {};
export const setLimits = (bytes) => Object.assign(limits, bytes);

// Sends a file; `progress` gets the share that has arrived.
export function upload(kind, file, name, progress = () => {}) {
  if (file.size > limits[kind]) return Promise.reject(new Refused(`${name} is larger than ${Math.round(limits[kind] / 1e6)} MB, the most that is taken; cut it first.`));
  return new Promise((done, fail) => {
    const request = new XMLHttpRequest();
    request.open("POST", `api/uploads/${kind}`);
    request.setRequestHeader("x-file-name", encodeURIComponent(name));
    request.setRequestHeader("content-type", "application/octet-stream");
    request.upload.addEventListener("progress", (event) => { if (event.lengthComputable) progress(event.loaded / event.total); });
    request.addEventListener("load", () => {
      if (request.status < 300) done(JSON.parse(request.responseText));
      else fail(reason(request.status, request.responseText));
    });
    request.addEventListener("error", () => fail(new Refused(LOST)));
    request.send(file);
  });
}

// Calls with each state; the browser connects again by itself.
export function follow(onState, onConnection) {
  const source = new EventSource("api/events");
  source.addEventListener("message", (event) => { onConnection(true); onState(JSON.parse(event.data)); });
  source.addEventListener("open", () => onConnection(true));
  source.addEventListener("error", () => onConnection(false));
  addEventListener("pagehide", () => source.close());
}
