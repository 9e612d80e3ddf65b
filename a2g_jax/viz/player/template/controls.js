// Pointers, wheel and keys on the stage: orbit, pan, zoom.

const VIEWS = { front: { yaw: 0, pitch: 0.06 }, side: { yaw: Math.PI / 2, pitch: 0.06 }, top: { yaw: 0, pitch: Math.PI / 2 } };

function attachCamera(canvas, player) {
  const pointers = new Map();
  const metre = () => (player.bands[0] ? player.bands[0].metre : 200);
  const orbit = (dx, dy) => player.view({ yaw: player.camera.yaw - dx * 0.008, pitch: clamp(player.camera.pitch + dy * 0.006, -0.05, Math.PI / 2) });
  const pan = (dx, dy) => player.view({ panX: clamp(player.camera.panX - dx / metre(), -8, 8), panY: clamp(player.camera.panY + dy / metre(), -3, 3) });
  const zoom = (factor) => player.view({ zoom: clamp(player.camera.zoom * factor, 0.3, 12) });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("dblclick", () => player.view(START));
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY, pans: event.button === 2 || event.button === 1 || event.shiftKey });
  });
  canvas.addEventListener("pointermove", (event) => {
    const held = pointers.get(event.pointerId);
    if (!held) return;
    const dx = event.clientX - held.x, dy = event.clientY - held.y;
    if (pointers.size === 2) {
      const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
      const before = Math.hypot(held.x - other.x, held.y - other.y), after = Math.hypot(event.clientX - other.x, event.clientY - other.y);
      if (before > 4) zoom(after / before);
      pan(dx / 2, dy / 2);
    } else if (held.pans) pan(dx, dy);
    else orbit(dx, dy);
    held.x = event.clientX; held.y = event.clientY;
  });
  for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) canvas.addEventListener(name, (event) => pointers.delete(event.pointerId));
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 16 : 1;
    zoom(Math.exp(-clamp(event.deltaY * lines, -120, 120) * 0.0016));
  }, { passive: false });
}

function attachKeys(player) {
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const field = event.target.closest && event.target.closest("select, input"), button = event.target.closest && event.target.closest("button");
    if (field) return;
    const key = event.key.toLowerCase();
    const actions = {
      " ": () => player.toggle(), k: () => player.toggle(),
      arrowleft: () => player.step(event.shiftKey ? -10 : -1), arrowright: () => player.step(event.shiftKey ? 10 : 1),
      home: () => player.seek(0), end: () => player.seek(player.duration),
      l: () => document.getElementById("loop").click(), m: () => document.getElementById("mute").click(),
      o: () => document.getElementById("overlay").click(), r: () => document.getElementById("trails").click(),
      f: () => player.view(VIEWS.front), s: () => player.view(VIEWS.side), t: () => player.view(VIEWS.top),
    };
    let action = actions[key];
    if (/^[0-9]$/.test(key)) action = () => player.solo(key === "0" ? null : Number(key) - 1);
    if (!action || (key === " " && button)) return;
    event.preventDefault();
    action();
  });
  // A click must not leave the space key bound to the button that was clicked.
  document.addEventListener("click", (event) => {
    const button = event.target.closest("button");
    if (button && event.detail > 0) button.blur();
  });
}
