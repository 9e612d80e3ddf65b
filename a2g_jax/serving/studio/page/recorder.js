// A microphone as a WAV file, and any sound that the browser can decode as one.

export const LONGEST = 595; // seconds; the server takes 600, and the last block comes after the end

export class Recorder {
  // `onLevel` gets the loudest sample of each block and the seconds so far.
  static async start(onLevel) {
    if (!navigator.mediaDevices || !window.AudioWorkletNode) throw new Error("This browser gives no microphone to this page; open it as http://127.0.0.1, or choose a file.");
    let stream;
    try {
      stream = await navigator.mediaDevices.getUserMedia({ audio: { channelCount: 1, echoCancellation: false, noiseSuppression: false } });
    } catch (error) {
      const why = { NotAllowedError: "The browser was not allowed to use the microphone; allow it beside the address, or choose a file.", NotFoundError: "No microphone was found; connect one, or choose a file." };
      throw new Error(why[error.name] || `The microphone cannot be used (${error.message}).`);
    }
    const recorder = new Recorder();
    recorder.stream = stream;
    recorder.context = new AudioContext();
    recorder.blocks = [];
    recorder.count = 0;
    try { await recorder.context.audioWorklet.addModule("capture.js"); } catch (error) {
      for (const track of stream.getTracks()) track.stop();
      throw error;
    }
    const node = new AudioWorkletNode(recorder.context, "capture", { numberOfOutputs: 0 });
    node.port.onmessage = ({ data }) => {
      recorder.blocks.push(data);
      recorder.count += data.length;
      let peak = 0;
      for (const value of data) peak = Math.max(peak, Math.abs(value));
      onLevel(peak, recorder.count / recorder.context.sampleRate);
    };
    recorder.context.createMediaStreamSource(stream).connect(node);
    return recorder;
  }

  async stop() {
    for (const track of this.stream.getTracks()) track.stop();
    const rate = this.context.sampleRate;
    await this.context.close();
    const samples = new Float32Array(this.count);
    let at = 0;
    for (const block of this.blocks) { samples.set(block, at); at += block.length; }
    return wavOf(samples, rate);
  }
}

// The sound of a file, such as the track of an MP4, as a mono WAV.
export async function decoded(file) {
  const sound = await new OfflineAudioContext(1, 1, 48000).decodeAudioData(await file.arrayBuffer());
  const mixed = new Float32Array(sound.length);
  for (let channel = 0; channel < sound.numberOfChannels; channel++) {
    const samples = sound.getChannelData(channel);
    for (let i = 0; i < mixed.length; i++) mixed[i] += samples[i] / sound.numberOfChannels;
  }
  return wavOf(mixed, sound.sampleRate);
}

function wavOf(samples, rate) {
  const view = new DataView(new ArrayBuffer(44 + 2 * samples.length));
  const text = (at, letters) => [...letters].forEach((letter, i) => view.setUint8(at + i, letter.charCodeAt(0)));
  text(0, "RIFF"); view.setUint32(4, 36 + 2 * samples.length, true); text(8, "WAVEfmt ");
  view.setUint32(16, 16, true); view.setUint16(20, 1, true); view.setUint16(22, 1, true);
  view.setUint32(24, rate, true); view.setUint32(28, 2 * rate, true); view.setUint16(32, 2, true); view.setUint16(34, 16, true);
  text(36, "data"); view.setUint32(40, 2 * samples.length, true);
  const values = new Int16Array(view.buffer, 44);
  for (let i = 0; i < samples.length; i++) values[i] = Math.round(32767 * Math.min(Math.max(samples[i], -1), 1));
  return new Blob([view], { type: "audio/wav" });
}
