// What the page holds in base64: positions of motions, and the speech.

function bytesOf(text) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return bytes;
}

// Positions in metres, frame after frame, from compressed second differences of each coordinate over time.
async function unpackPositions(figure) {
  const packed = new Blob([bytesOf(figure.data)]).stream().pipeThrough(new DecompressionStream("deflate"));
  const parts = new Uint8Array(await new Response(packed).arrayBuffer());
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
