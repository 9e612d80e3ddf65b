// What the page holds in base64: positions of motions, and the speech.

function bytesOf(text) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return bytes;
}

async function inflate(text) {
  const packed = new Blob([bytesOf(text)]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(packed).arrayBuffer();
}

// Positions in metres, frame after frame, from compressed second differences of each coordinate over time.
async function unpackPositions(figure) {
  const parts = new Uint8Array(await inflate(figure.data));
  const columns = 3 * figure.points, { frames } = figure, half = columns * frames, out = new Float32Array(half);
  for (let column = 0; column < columns; column++) {
    const low = figure.low[column % 3], step = figure.step[column % 3];
    let value = 0, speed = 0;
    for (let frame = 0, i = column * frames; frame < frames; frame++, i++) {
      const code = parts[i] | (parts[half + i] << 8);
      speed = (speed + ((code >> 1) ^ -(code & 1))) & 65535;
      value = (value + speed) & 65535;
      out[frame * columns + column] = low + step * value;
    }
  }
  return out;
}

// A skinned mesh: vertices where they are bound, their bones and weights, colours with a gloss, and triangles.
async function unpackMesh(mesh, id) {
  const buffer = await inflate(mesh.data), { vertices, triangles } = mesh;
  let at = 0;
  const take = (Kind, count) => { const part = new Kind(buffer, at, count); at += part.byteLength; return part; };
  const codes = take(Uint16Array, 3 * vertices), bones = take(Uint16Array, 4 * vertices), corners = take(Uint16Array, 3 * triangles);
  const normals = Float32Array.from(take(Int8Array, 3 * vertices), (x) => x / 127), shades = take(Uint8Array, 3 * vertices), shares = take(Uint8Array, 4 * vertices);
  const places = Float32Array.from(codes, (code, i) => mesh.low[i % 3] + mesh.step[i % 3] * code), weights = new Float32Array(4 * vertices), colours = new Float32Array(4 * vertices);
  for (let i = 0; i < vertices; i++) {
    const total = shares[4 * i] + shares[4 * i + 1] + shares[4 * i + 2] + shares[4 * i + 3];
    for (let k = 0; k < 4; k++) weights[4 * i + k] = shares[4 * i + k] / total;
    for (let k = 0; k < 3; k++) colours[4 * i + k] = Math.pow(shades[3 * i + k] / 255, 2.2);
    colours[4 * i + 3] = 0.12;
  }
  return { id, count: vertices, bind: places, facing: normals, bones, weights, colours, indices: corners, open: mesh.open, centres: mesh.centres };
}

// 16-bit samples of the speech, and a WAV file of them, which any browser seeks in exactly; null without speech.
async function unpackSpeech({ type, data, samples, rate }) {
  if (!data) return null;
  const bytes = bytesOf(data);
  if (type === "audio/wav") return { samples: new Int16Array(bytes.buffer, 44, samples), rate, wav: bytes };
  const decoded = await new OfflineAudioContext(1, 1, rate).decodeAudioData(bytes.buffer);
  const found = decoded.getChannelData(0), exact = new Int16Array(samples);
  // Browsers that keep the delay of MP3's encoder and decoder have more samples than the speech, by at least that.
  const from = found.length - samples >= MP3_DELAY ? MP3_DELAY : 0;
  for (let i = 0; i < samples; i++) exact[i] = Math.round(32767 * clamp(found[i + from] || 0, -1, 1));
  return { samples: exact, rate, wav: wavOf(exact, rate) };
}

const MP3_DELAY = 1105; // samples: 576 of the encoder, 529 of the decoder

function wavOf(samples, rate) {
  const bytes = new Uint8Array(44 + 2 * samples.length), view = new DataView(bytes.buffer);
  const text = (at, letters) => [...letters].forEach((letter, i) => view.setUint8(at + i, letter.charCodeAt(0)));
  text(0, "RIFF"); view.setUint32(4, bytes.length - 8, true); text(8, "WAVEfmt ");
  view.setUint32(16, 16, true); view.setUint16(20, 1, true); view.setUint16(22, 1, true);
  view.setUint32(24, rate, true); view.setUint32(28, 2 * rate, true); view.setUint16(32, 2, true); view.setUint16(34, 16, true);
  text(36, "data"); view.setUint32(40, 2 * samples.length, true);
  new Int16Array(bytes.buffer, 44).set(samples);
  return bytes;
}
