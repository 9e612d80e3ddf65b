// The start of the page, and its interface for tests and pictures.

async function open(data) {
  const unpacked = Promise.all(data.figures.map(unpackPositions)), meshes = Promise.all(data.meshes.map(unpackMesh));
  const speech = await unpackSpeech(data.audio).catch((error) => {
    console.warn("This browser cannot decode the speech; the figures move without it:", error.message);
    return null;
  });
  return new Player(data, await unpacked, await meshes, speech);
}

let player = null;
const opening = open(JSON.parse(document.getElementById("data").textContent)).then((made) => { player = made; return made.ready; });
opening.catch((error) => {
  document.getElementById("labels").textContent = `This browser is too old for the page (${error.message}).`;
});
// Everything but `ready` is there once that has resolved.
window.a2gPlayer = {
  ready: opening,
  get renderer() { return player.renderer.name; },
  get figures() { return player.figures.map(({ label, note, fps, frames, points }) => ({ label, note, fps, frames, points })); },
  play: () => player.play(),
  pause: () => player.pause(),
  seek: (time) => player.seek(time),
  time: () => player.now,
  frame: (index = 0) => Math.round(player.figures[index].frameAt(player.now)),
  solo: (index) => player.solo(index),
  view: (change) => player.view(change),
  playing: () => player.playing,
  vertices: (index = 0) => Array.from(player.figures[index].mesh.places),
  // Draws moving pictures from a second on, 25 of a second, each complete before the next.
  moving: (from, count) => {
    const { gl } = player.renderer, pixel = new Uint8Array(4);
    for (let i = 0; i < count; i++) {
      player.now = from + 0.04 * i;
      player.draw(performance.now(), false);
      if (gl) gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    }
  },
  pictures: () => player.pictures,
  scale: () => player.renderer.scale,
  speech: () => player.speech,
  // The tooltip of a position in the detailed timeline, in CSS pixels from its corner; lanes from top to bottom.
  tell: (x, y) => player.timeline.tell(x, y) || null,
  lanes: () => player.timeline.rows().map(({ kind, height, lane, figure }) => ({ kind, height, name: lane ? lane.name : kind, figure: figure ? figure.label : null })),
  // Resolves when a picture of the present moment, at full quality, is on screen.
  still: () => new Promise((done) => requestAnimationFrame((stamp) => {
    player.draw(stamp, true);
    clearTimeout(player.settling);
    requestAnimationFrame(() => requestAnimationFrame(() => done(true)));
  })),
};
