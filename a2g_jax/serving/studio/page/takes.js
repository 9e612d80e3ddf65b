// Takes: progress, samples with stars and files, and which of them the player shows.

import { post, remove } from "./api.js";
import { clock, duration, find, make, number, showError, tell } from "./dom.js";
import { isShown, keepOnly, onShown, show, shownSamples, toggle } from "./player.js";

const ENDED = ["done", "failed", "cancelled"];
const NAMES = { bvh: "BVH (Blender)", npz: "NPZ", glb: "GLB", mp4: "MP4 (film)", smplx: "SMPL-X" };
const ZIPPED = ["bvh", "glb", "npz"];

let about = null, takes = [], reuse = () => {}, mine = new Set(), waitingFilms = new Set(), first = true;
const orders = new Map(), drawn = new Map(), failed = new Map();

export function beginTakes(facts, onReuse) {
  about = facts;
  reuse = onReuse;
  onShown(() => draw(true));
}

// A take that this page requested is shown once it is done.
export function expect(take) {
  mine.add(take.id);
  update({ takes: [take, ...takes.filter((other) => other.id !== take.id)] });
  cardOf(take)?.scrollIntoView({ block: "nearest" });
}

export function update(state) {
  takes = state.takes;
  keepOnly(new Set(takes.map((take) => take.id)));
  draw();
  for (const take of takes) {
    if (mine.has(take.id) && ENDED.includes(take.job.state)) {
      mine.delete(take.id);
      if (take.job.state === "done") {
        showTake(take);
        tell(`take ${take.number} is done`);
        if (innerWidth <= 860) find("stage").scrollIntoView();
      }
      if (take.job.state === "failed" && take.job.error.field) showError(take.job.error.field, take.job.error.message);
    }
    for (const sample of take.samples || []) for (const [format, job] of Object.entries(sample.films)) {
      const key = `${take.id}/files/${sample.number}/${format}`;
      if (!waitingFilms.has(key) || !ENDED.includes(job.state)) continue;
      waitingFilms.delete(key);
      if (job.state === "done") download(`api/takes/${key}`);
    }
  }
  find("welcome-title").textContent = takes.some((take) => !ENDED.includes(take.job.state)) ? "One moment." : "Press Generate.";
  // A page that is opened again shows the newest take.
  const newest = takes.find((take) => take.job.state === "done");
  if (first && newest && !shownSamples().length) showTake(newest);
  first = false;
}

const cardOf = (take) => find("takes").querySelector(`[data-take="${take.id}"]`);

function sortedSamples(take) {
  const by = orders.get(take.id) || "made", samples = [...take.samples];
  if (by === "stars") samples.sort((a, b) => b.stars - a.stars);
  if (by === "score") samples.sort((a, b) => b.score - a.score);
  return samples;
}

const showTake = (take) => show(sortedSamples(take).map((sample) => ({ take: take.id, sample: sample.number, speech: take.speech.id })));

// --- cards ---

// A take without what changes all the time while it is worked on.
function lasting(take) {
  const still = (job) => [job.state === "queued" ? "running" : job.state, job.error];
  const samples = take.samples?.map((sample) => ({ ...sample, films: Object.entries(sample.films).map(([format, job]) => [format, still(job)]) }));
  return { ...take, job: still(take.job), samples };
}

// Progress is written into the cards as they are: a button that is being pressed must not be replaced.
function refresh(card, take) {
  const bar = card.querySelector("progress");
  if (bar) fill(bar, bar.nextElementSibling, take.job);
  for (const sample of take.samples || []) for (const [format, job] of Object.entries(sample.films)) {
    const button = card.querySelector(`[data-film="${sample.number}/${format}"]`);
    if (button) button.textContent = `${nameOf(format)} ${filmWords(job)} ×`;
  }
}

// Cards that changed are drawn again; the focus stays on the same button.
function draw(all = false) {
  const list = find("takes"), focused = document.activeElement?.dataset?.key;
  const cards = takes.map((take) => {
    const text = JSON.stringify([lasting(take), orders.get(take.id), failed.get(take.id)]);
    const old = drawn.get(take.id);
    if (old && old.text === text && !all) { refresh(old.card, take); return old.card; }
    const card = makeCard(take);
    drawn.set(take.id, { text, card });
    return card;
  });
  for (const id of [...drawn.keys()]) if (!takes.some((take) => take.id === id)) drawn.delete(id);
  if (cards.length !== list.children.length || cards.some((card, i) => card !== list.children[i])) list.replaceChildren(...cards);
  if (focused) list.querySelector(`[data-key="${CSS.escape(focused)}"]`)?.focus({ preventScroll: true });
}

function makeCard(take) {
  const { job } = take;
  const count = take.count === 1 ? "1 sample" : `${take.count} samples`;
  const head = make("div", { class: "line head" },
    make("b", {}, `Take ${take.number}`), make("span", { class: "soft about" }, `${about.titles[take.system] || take.system}, ${count} for ${take.speech.name}, seed ${take.request.seed}`), make("span", { class: "gap" }),
    job.state === "done" && make("button", { type: "button", "data-key": `show-${take.id}`, onclick: () => showTake(take) }, "Show"),
    menu(take));
  const error = failed.get(take.id) || (job.state === "failed" ? job.error.message : "");
  return make("article", { class: `take card ${job.state}`, "data-take": take.id, "aria-label": `Take ${take.number}` }, head,
    !ENDED.includes(job.state) && progress(job, () => act(take, post(`api/takes/${take.id}/cancel`)), `cancel-${take.id}`),
    job.state === "cancelled" && make("p", { class: "soft" }, "Cancelled."),
    error && make("p", { class: "error", role: "alert" }, error),
    take.warning && make("p", { class: "warning" }, take.warning),
    take.samples && detail(take), take.samples && make("div", { class: "samples" }, sortedSamples(take).map((sample) => row(take, sample))), take.samples && foot(take));
}

function menu(take) {
  return make("details", { class: "menu" }, make("summary", { "aria-label": `More about take ${take.number}`, "data-key": `menu-${take.id}` }, "⋯"),
    make("div", { class: "card" },
      make("button", { type: "button", onclick: (event) => { close(event); reuse(take.request); } }, "Use these settings"),
      make("button", { type: "button", onclick: (event) => { close(event); navigator.clipboard?.writeText(take.command); tell("the command is copied"); } }, "Copy the command"),
      make("button", { type: "button", class: "danger", onclick: () => act(take, remove(`api/takes/${take.id}`)) }, "Delete")));
}

const close = (event) => { event.target.closest("details").open = false; };

function detail(take) {
  const lines = take.lines.filter((line) => line), first = take.plain || lines[0];
  return lines.length > 0 && make("details", { class: "lines" }, make("summary", { title: lines.join("\n") }, make("span", { class: "soft" }, first)), lines.slice(take.plain ? 0 : 1).map((line) => make("p", { class: "soft" }, line)), make("code", {}, take.command));
}

function progress(job, cancel, key) {
  const bar = make("progress", { "aria-label": job.title }), words = make("span", { class: "soft" });
  fill(bar, words, job);
  return make("div", { class: "line progress" }, bar, words,
    make("button", { type: "button", "data-key": key, disabled: job.state === "stopping", onclick: cancel }, "Cancel"));
}

function fill(bar, words, job) {
  bar.max = Math.max(job.total, 1);
  if (job.state === "queued" || (job.done === 0 && job.remaining === null)) bar.removeAttribute("value"); else bar.value = shareOf(job);
  if (words.textContent !== wordsOf(job)) words.textContent = wordsOf(job);
}

// Where one step takes long, the estimate moves the bar between steps.
function shareOf(job) {
  if (job.remaining === null || job.seconds === 0) return job.done;
  return Math.max(job.done, Math.min(job.total * job.seconds / (job.seconds + job.remaining), job.done + 0.95));
}

function wordsOf(job) {
  if (job.state === "queued") return job.position > 1 ? `waits for ${job.position} others` : "waits for the one before";
  if (job.state === "stopping") return "stopping…";
  const parts = [job.phase, `${job.done} of ${job.total} ${job.unit}s`].filter((part) => part && job.total);
  if (job.rate && job.done) parts.push(job.rate >= 1 ? `${number(job.rate, 1)} ${job.unit}s a second` : `${duration(1 / job.rate)} a ${job.unit}`);
  if (job.remaining !== null) parts.push(`about ${duration(job.remaining)} left`);
  else if (job.phase === "generating") parts.push(`${clock(job.seconds)}; the first request of a system takes longer`);
  return parts.join(" · ") || job.phase;
}

// --- samples ---

function row(take, sample) {
  const one = { take: take.id, sample: sample.number, speech: take.speech.id }, on = isShown(take.id, sample.number);
  const eye = make("button", { type: "button", class: "eye", "aria-pressed": String(on), "data-key": `eye-${take.id}-${sample.number}`, title: on ? "In the player; press to take it out" : "Press to see it in the player, beside the others", onclick: () => toggle(one) }, `sample ${sample.number}`);
  const best = take.count > 1 && take.samples.every((other) => other.score <= sample.score);
  const score = sample.score === null ? null : make("span", { class: best ? "score best" : "score", title: "How well the motion goes with the speech; higher is better" }, `${best ? "best:" : "score"} ${sample.score.toFixed(2)}`);
  return make("div", { class: "sample" }, eye, stars(take, sample), score, make("span", { class: "gap" }), make("span", { class: "files" }, make("span", { class: "soft" }, "Download"), about.formats.map((format) => file(take, sample, format))), sample.note && make("p", { class: "note" }, sample.note));
}

function stars(take, sample) {
  const label = (count) => (count === 1 ? "1 star" : `${count} stars`);
  return make("span", { class: "stars", role: "group", "aria-label": `Ranking of sample ${sample.number}: ${label(sample.stars)}` }, Array.from({ length: about.most_stars }, (_, k) => {
    const given = k + 1 === sample.stars ? 0 : k + 1;
    return make("button", { type: "button", "data-key": `star-${take.id}-${sample.number}-${k}`, class: k < sample.stars ? "lit" : "", "aria-label": label(k + 1), onclick: () => act(take, post(`api/takes/${take.id}/stars`, { sample: sample.number, stars: given })) }, k < sample.stars ? "★" : "☆");
  }));
}

const nameOf = (format) => NAMES[format] || format.toUpperCase();

function filmWords(job) {
  if (job.state !== "running") return job.state === "queued" ? "waits" : "stops…";
  return job.total ? `${Math.floor(100 * job.done / job.total)} %${job.remaining ? `, ${duration(job.remaining)}` : ""}` : "begins…";
}

function file(take, sample, format) {
  const name = nameOf(format), path = `${take.id}/files/${sample.number}/${format}`, key = `file-${path}`;
  if (!(format in about.slow)) return make("a", { class: "button", href: `api/takes/${path}`, download: "", "data-key": key, title: `Download sample ${sample.number} as ${name}` }, name);
  const job = sample.films[format];
  if (job && job.state === "done") return make("a", { class: "button ready", href: `api/takes/${path}`, download: "", "data-key": key, title: `Download sample ${sample.number} as ${name}` }, name);
  if (job && !ENDED.includes(job.state)) {
    return make("button", { type: "button", class: "busy", "data-key": key, "data-film": `${sample.number}/${format}`, title: "Press to cancel", onclick: () => act(take, post(`api/takes/${take.id}/films/${sample.number}/${format}/cancel`)) }, `${name} ${filmWords(job)} ×`);
  }
  const missing = about.slow[format], why = job?.state === "failed" ? job.error.message : missing;
  return make("button", { type: "button", disabled: Boolean(missing), "data-key": key, title: why || `Make a film of sample ${sample.number}`, onclick: () => { waitingFilms.add(path); act(take, post(`api/takes/${take.id}/films/${sample.number}/${format}`)); } }, name);
}

function foot(take) {
  const options = [["made", "as generated"], ["stars", "most stars first"]];
  if (take.samples.every((sample) => sample.score !== null)) options.push(["score", "best score first"]);
  const order = make("select", { "data-key": `order-${take.id}`, onchange: () => { orders.set(take.id, order.value); draw(); showTake(take); } }, options.map(([value, text]) => make("option", { value, selected: value === (orders.get(take.id) || "made") }, text)));
  const formats = [...ZIPPED.filter((format) => about.formats.includes(format)), ...Object.keys(about.slow)].join(",");
  return make("div", { class: "line foot" }, take.count > 1 && make("label", { class: "order" }, make("span", { class: "soft" }, "Order"), order), make("span", { class: "gap" }),
    make("a", { class: "button", href: `api/takes/${take.id}/all.zip?formats=${formats}`, download: "", "data-key": `zip-${take.id}` }, "Download all (zip)"));
}

async function act(take, request) {
  try { await request; failed.delete(take.id); } catch (error) { failed.set(take.id, error.message); draw(); }
}

function download(path) {
  const link = make("a", { href: path, download: "" });
  document.body.append(link);
  link.click();
  link.remove();
}
