// The studio: the form on the left, the player and the takes on the right.

import { follow, get, setLimits } from "./api.js";
import { find, showError } from "./dom.js";
import { addPin, beginForm, reuse } from "./form.js";
import { takeSpeech } from "./speech.js";
import { beginTakes, expect, update } from "./takes.js";

const endsWith = (name, suffixes) => suffixes.split(",").some((suffix) => name.toLowerCase().endsWith(suffix));

// Files that are dropped anywhere: speech, or a clip for the timeline.
function attachDrop(about) {
  const holdsFiles = (event) => event.dataTransfer && [...event.dataTransfer.types].includes("Files");
  addEventListener("dragover", (event) => { if (holdsFiles(event)) { event.preventDefault(); find("drop").hidden = false; } });
  addEventListener("dragleave", (event) => { if (!event.relatedTarget) find("drop").hidden = true; });
  addEventListener("drop", (event) => {
    find("drop").hidden = true;
    if (!holdsFiles(event)) return;
    event.preventDefault();
    const [file] = event.dataTransfer.files;
    if (!file) return;
    if (endsWith(file.name, about.accept.clip)) addPin(file); else takeSpeech(file);
  });
}

async function begin() {
  const about = await get("api/about");
  setLimits(about.most_bytes);
  beginTakes(about, reuse);
  follow(update, (connected) => { document.body.classList.toggle("lost", !connected); });
  attachDrop(about);
  // A menu closes when something else is pressed.
  addEventListener("click", (event) => { for (const menu of document.querySelectorAll("details.menu[open]")) if (!menu.contains(event.target)) menu.open = false; });
  await beginForm(about, expect);
}

window.a2gStudio = begin();
window.a2gStudio.catch((error) => showError("", error.message));
