// The frame with the player: the page that `a2g generate` writes, for the chosen samples.

import { find } from "./dom.js";

let shown = [], listeners = [];

export const isShown = (take, sample) => shown.some((one) => one.take === take && one.sample === sample);
export const shownSamples = () => shown;
export function onShown(listener) { listeners.push(listener); }

// Plays samples, given as [{take, sample, speech}]; the moment stays if the speech does.
export async function show(samples) {
  const frame = find("player"), before = frame.contentWindow?.a2gPlayer;
  const same = shown.length && samples.length && shown[0].speech === samples[0].speech;
  const time = before && same && !frame.hidden ? before.time() : 0;
  shown = samples;
  find("welcome").hidden = samples.length > 0;
  frame.hidden = samples.length === 0;
  for (const listener of listeners) listener();
  if (!samples.length) { frame.removeAttribute("src"); return; }
  const source = `page?show=${samples.map(({ take, sample }) => `${take}:${sample}`).join(",")}`;
  await new Promise((done) => { frame.addEventListener("load", done, { once: true }); frame.src = source; });
  const player = frame.contentWindow.a2gPlayer;
  if (!player) return;
  await player.ready;
  if (time > 0) player.seek(time);
}

// Shows or hides one sample beside the others of the same speech.
export function toggle(one) {
  if (isShown(one.take, one.sample)) {
    if (shown.length > 1) show(shown.filter((other) => other.take !== one.take || other.sample !== one.sample));
  } else show([...shown.filter((other) => other.speech === one.speech), one]);
}

// Samples of takes that are gone are not shown any more.
export function keepOnly(takes) {
  const left = shown.filter((one) => takes.has(one.take));
  if (left.length < shown.length) show(left);
}
