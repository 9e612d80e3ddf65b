// The speech: the demo's, a file, or a recording.

import { Refused, upload } from "./api.js";
import { clearErrors, clock, drawWave, find, make, showError, tell } from "./dom.js";
import { LONGEST, Recorder, decoded } from "./recorder.js";

let demo = null, recorder = null, waiting = false, sound = null, chosen = null, changed = () => {};

export const speech = () => chosen;

export function beginSpeech(about, onChange) {
  changed = onChange;
  demo = about.speeches[0];
  find("speech-file").accept = `${about.accept.speech},audio/*,video/mp4`;
  find("speech-file").addEventListener("change", ({ target }) => { if (target.files[0]) takeSpeech(target.files[0]); target.value = ""; });
  find("use-demo").addEventListener("click", () => choose(demo));
  find("record").addEventListener("click", () => (recorder ? stop() : record()));
  find("listen").addEventListener("click", listen);
  choose(demo);
}

function choose(upload, source = null) {
  chosen = upload;
  if (sound) { sound.pause(); URL.revokeObjectURL(sound.src); sound = null; }
  find("listen").hidden = !source;
  if (source) {
    sound = new Audio(URL.createObjectURL(source));
    for (const name of ["play", "pause", "ended"]) sound.addEventListener(name, () => find("listen").classList.toggle("playing", !sound.paused));
  }
  find("speech-name").textContent = upload.name;
  find("speech-length").textContent = clock(upload.seconds);
  find("use-demo").hidden = upload === demo;
  drawWave(find("speech-wave"), upload.peaks);
  find("speech-warnings").replaceChildren(...upload.warnings.map((text) => make("li", {}, text)));
  changed(upload);
}

function listen() { if (sound.paused) sound.play(); else { sound.pause(); sound.currentTime = 0; } }

// A file that was chosen or dropped.
export async function takeSpeech(file, name = file.name) {
  const place = document.querySelector('[data-field="speech"]');
  clearErrors(place);
  place.classList.add("waiting");
  const says = find("speech-length"), before = says.textContent;
  try {
    choose(await sent(file, name, (share) => { says.textContent = `${Math.round(100 * share)} %`; }), file);
    tell(`${name} is chosen`);
  } catch (error) {
    says.textContent = before;
    showError("speech", error.message);
  } finally { place.classList.remove("waiting"); }
}

// Where the server has no ffmpeg for a video's sound, the browser decodes it.
async function sent(file, name, progress) {
  try { return await upload("speech", file, name, progress); } catch (error) {
    if (!(error instanceof Refused) || !error.message.includes("needs ffmpeg")) throw error;
    let wav;
    try { wav = await decoded(file); } catch { throw error; }
    return upload("speech", wav, `${name.replace(/\.[^.]*$/, "")}.wav`, progress);
  }
}

async function record() {
  if (waiting) return; // for the microphone: a second one would never be stopped
  waiting = true;
  clearErrors(document.querySelector('[data-field="speech"]'));
  try {
    recorder = await Recorder.start((peak, seconds) => {
      find("level").value = Math.sqrt(peak);
      find("recorded").textContent = clock(seconds);
      if (seconds >= LONGEST && recorder) stop();
    });
  } catch (error) { showError("speech", error.message); return; } finally { waiting = false; }
  showRecording(true);
}

async function stop() {
  const ended = recorder;
  recorder = null;
  showRecording(false);
  await takeSpeech(await ended.stop(), "recording.wav");
}

function showRecording(on) {
  find("recording").hidden = !on;
  find("recorded").textContent = clock(0);
  find("record").classList.toggle("on", on);
  find("record").querySelector("span").textContent = on ? "Stop" : "Record";
  tell(on ? "recording" : "recording ended");
}
