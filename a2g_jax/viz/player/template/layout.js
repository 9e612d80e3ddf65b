// Where figures stand, how many rows there are, and the camera that shows them whole.

const FIELD = 0.42; // vertical field of view of a whole stage, radians: long lens, little distortion at the sides
const START = { yaw: -0.3, pitch: 0.17, zoom: 1, panX: 0, panY: 0 };

// Free pixels around the bodies in each band: room for the heading and for the labels.
function margins(row, rows, phone, overlay) {
  return { top: row === 0 ? (overlay ? 74 : 52) : 18, bottom: overlay ? 22 : (phone && row === rows - 1 ? 84 : 62), side: phone ? 8 : 26 };
}

const LABEL = 88; // CSS pixels that a figure's label needs to be legible

function chooseRows(count, spacing, tall, width, height) {
  let best = 1, bestScale = 0;
  const most = Math.min(count, 4);
  for (let rows = 1; rows <= most; rows++) {
    const columns = Math.ceil(count / rows);
    if (width / columns < LABEL && rows < most) continue;
    const scale = Math.min((height / rows - 90) / tall, width / (columns * spacing));
    if (scale > bestScale * 1.08) { best = rows; bestScale = scale; }
  }
  return best;
}

// Bands of the stage with slots for the visible figures (indices), for a stage of width x height CSS pixels.
function arrange(figures, visible, overlay, width, height) {
  const reach = Math.max(...visible.map((i) => figures[i].place.reach));
  const tall = Math.max(...visible.map((i) => figures[i].place.height));
  let spacing = clamp(1.4 * reach, 0.5 * tall, 1.3 * tall);
  const rows = overlay ? 1 : chooseRows(visible.length, spacing, tall, width, height);
  const columns = overlay ? visible.length : Math.ceil(visible.length / rows), phone = width < 640;
  // Bands differ in margins; what is free for bodies is equal, and so is their size.
  const edges = Array.from({ length: rows }, (_, row) => margins(row, rows, phone, overlay));
  const free = Math.max((height - edges.reduce((sum, edge) => sum + edge.top + edge.bottom, 0)) / rows, 24);
  // Where height decides the size, use the width that is left, within reason and for the labels.
  const metre = free / (1.1 * tall), fills = (width - (phone ? 20 : 60)) / (columns * metre);
  if (!overlay) spacing = Math.max(spacing, Math.min(fills, Math.max(0.95 * tall, 1.4 * LABEL / metre)));
  const bands = [];
  for (let row = 0, y = 0; row < rows; row++) {
    const members = visible.slice(row * columns, (row + 1) * columns), margin = edges[row];
    const bottom = row === rows - 1 ? height : Math.round(y + margin.top + free + margin.bottom);
    bands.push({
      x: 0, y, width, height: bottom - y, members, margin,
      slots: members.map((_, k) => (overlay ? [0, 0, 0] : [(k - (members.length - 1) / 2) * spacing, 0, 0])),
      spacing,
      // The widest row decides the size, so that all rows show bodies equally large.
      frame: { half: overlay ? spacing / 2 : columns * spacing / 2, tall },
      extent: { half: [(overlay ? 0.5 : members.length / 2) * spacing + 0.5, Math.max(reach, 0.7)], height: 1.25 * tall },
    });
    y = bottom;
  }
  return bands;
}

function placeCamera(band, camera) {
  const { frame, margin } = band, aspect = band.width / band.height;
  const room = { x: Math.max(1 - 2 * margin.side / band.width, 0.3), y: Math.max(1 - (margin.top + margin.bottom) / band.height, 0.3) };
  const depth = 0.16 * frame.tall;
  const corners = [];
  for (const x of [-frame.half, frame.half]) for (const y of [0, frame.tall]) for (const z of [-depth, depth]) corners.push([x, y, z]);
  // The distance is fitted for the starting pitch: tilting the camera must not zoom.
  const bounds = (pitch, distance) => {
    const target = [0, frame.tall / 2, 0], eye = [0, target[1] + distance * Math.sin(pitch), distance * Math.cos(pitch)];
    const m = multiply(perspective(FIELD, aspect, 0.05, 100, 0, 0), lookAt(eye, target, [0, 1, 0]));
    const projected = corners.map((corner) => project(m, corner));
    const wide = Math.max(...projected.map((p) => (p[2] > 0.1 ? Math.abs(p[0]) : 99)));
    return { wide, low: Math.min(...projected.map((p) => p[1])), high: Math.max(...projected.map((p) => p[1])), eye, target };
  };
  let near = 0.5, far = 80;
  for (let i = 0; i < 40; i++) {
    const middle = Math.sqrt(near * far), b = bounds(START.pitch, middle);
    if (b.wide <= room.x && b.high - b.low <= 2 * room.y) far = middle; else near = middle;
  }
  const fitted = bounds(camera.pitch, far), distance = far / camera.zoom;
  const shift = (margin.bottom - margin.top) / band.height - (fitted.high + fitted.low) / 2;
  const target = [camera.panX, frame.tall / 2 + camera.panY * Math.cos(camera.pitch), -camera.panY * Math.sin(camera.pitch)];
  const eye = [target[0], target[1] + distance * Math.sin(camera.pitch), target[2] + distance * Math.cos(camera.pitch)];
  const up = [0, Math.cos(camera.pitch), -Math.sin(camera.pitch)];
  const lens = perspective(FIELD, aspect, Math.max(0.05, distance - 12), distance + 60, 0, shift), view = lookAt(eye, target, up);
  band.eye = eye;
  band.camera = multiply(lens, view);
  band.inverse = invertCamera(lens, view);
  band.metre = band.height / (2 * Math.tan(FIELD / 2) * distance); // CSS pixels of a metre at the target
}

// Inverse of lens x view, of which both have a simple one.
function invertCamera(lens, view) {
  const back = [1 / lens[0], 0, 0, 0, 0, 1 / lens[5], 0, 0, 0, 0, 0, 1 / lens[14], lens[8] / lens[0], lens[9] / lens[5], -1, lens[10] / lens[14]];
  const v = view, turn = [v[0], v[4], v[8], 0, v[1], v[5], v[9], 0, v[2], v[6], v[10], 0, 0, 0, 0, 1];
  const move = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -v[12], -v[13], -v[14], 1];
  return multiply(multiply(turn, move), back);
}

// CSS pixel of a point of the stage.
function onScreen(band, point) {
  const p = project(band.camera, point);
  return [band.x + (p[0] + 1) / 2 * band.width, band.y + (1 - p[1]) / 2 * band.height, p[2]];
}
