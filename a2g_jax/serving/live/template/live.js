// Microphone -> server -> figure.

const SHOWN_BEHIND = 0.12; // seconds between the newest frame and the one that is shown
const BACKLOG = 10; // seconds of audio without frames, from which on server or connection are too slow
const LATE = 1.5; // seconds beyond what the model waits, from which on the page gives the reason
const FEW = 0.2; // seconds a picture, from which on drawing is the reason

const at = (id) => document.getElementById(id);
const seconds = (value) => `${value.toFixed(2)} s`;

class Live {
  constructor() {
    this.stage = new LiveStage();
    this.state = "idle";
    this.loudness = 0;
    this.frames = this.behind = this.interval = 0;
    this.late = false;
    at("speak").addEventListener("click", () => (this.state === "idle" ? this.start() : this.stop("Stopped.")));
    this.toggle("trails", (on) => { this.stage.trails = on; this.stage.wake(); });
    this.toggle("echo", (on) => { if (this.gain) this.gain.gain.value = on ? 1 : 0; });
    at("ahead").addEventListener("change", () => { if (this.state !== "idle") { this.stop(""); this.start(); } });
    this.stage.ticking = (stamp) => this.tick(stamp);
    this.ready = fetch("/figure.json").then((reply) => reply.json()).then(async (figure) => {
      this.mesh = figure.mesh ? await unpackMesh(figure.mesh, 0) : null;
      this.stage.show(new LiveFigure(figure, this.mesh));
    });
    this.ready.catch(() => this.say("The server does not answer.", true));
  }

  toggle(id, apply) {
    at(id).addEventListener("click", () => {
      const on = at(id).getAttribute("aria-pressed") !== "true";
      at(id).setAttribute("aria-pressed", on);
      apply(on);
    });
  }

  say(text, trouble = false) {
    at("status").textContent = text;
    at("status").classList.toggle("trouble", trouble);
  }

  become(state) {
    this.state = state;
    clearTimeout(this.stage.settling);
    at("speak").setAttribute("aria-pressed", state !== "idle");
    at("speak-text").textContent = state === "idle" ? "Speak" : "Stop";
    at("delays").hidden = state !== "live";
    this.stage.wake();
  }

  async start() {
    const attempt = (this.attempt = {});
    this.become("starting");
    this.say("Waiting for the microphone…");
    try {
      if (!navigator.mediaDevices || !window.AudioWorkletNode)
        throw new Error("This browser gives a microphone only to https or this computer: open http://127.0.0.1 here.");
      const given = await navigator.mediaDevices.getUserMedia({ audio: { channelCount: 1, echoCancellation: false, noiseSuppression: false, autoGainControl: false } });
      if (this.attempt !== attempt) { for (const track of given.getTracks()) track.stop(); return; }
      this.microphone = given;
      this.context = new AudioContext({ latencyHint: "interactive" });
      await this.context.audioWorklet.addModule("/capture.js");
      if (this.attempt !== attempt) return;
      given.getAudioTracks()[0].addEventListener("ended", () => this.stop("The microphone was disconnected.", true));
      this.connect(attempt);
    } catch (error) {
      if (this.attempt !== attempt) return;
      const reasons = { NotAllowedError: "The microphone is not allowed; allow it in the address bar.", NotFoundError: "There is no microphone." };
      this.stop(reasons[error.name] || error.message, true);
    }
  }

  connect(attempt) {
    this.say("Connecting…");
    const rate = this.context.sampleRate;
    const socket = (this.socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live`));
    socket.binaryType = "arraybuffer";
    const mine = () => this.attempt === attempt;
    socket.addEventListener("open", () => {
      const ahead = at("ahead").value;
      socket.send(JSON.stringify({ type: "hello", sample_rate: rate, encoding: "s16le", channels: 1, reply: "points", seed: Math.floor(Math.random() * 1e6), lookahead: ahead === "" ? null : Number(ahead) }));
      this.say("Preparing…");
    });
    socket.addEventListener("message", ({ data }) => {
      if (!mine()) return;
      if (typeof data !== "string") { this.receive(data); return; }
      const message = JSON.parse(data);
      if (message.type === "ready") this.listen(message, rate);
      else if (message.type === "error") this.refused = message.error;
    });
    socket.addEventListener("close", ({ reason }) => { if (mine()) this.stop(this.refused || reason || "The connection to the server is lost.", true); });
  }

  // Audio begins to flow once the server is ready: its time and that of the frames begin at the same sample.
  listen(message, rate) {
    const { context } = this, source = context.createMediaStreamSource(this.microphone), capture = new AudioWorkletNode(context, "capture");
    this.latency = message.latency.total;
    this.figure = new LiveFigure(message.figure, this.mesh);
    this.playhead = new Playhead(SHOWN_BEHIND);
    this.stage.show(this.figure);
    this.frames = this.sent = 0;
    this.began = null;
    capture.port.onmessage = ({ data }) => {
      if (this.socket?.readyState !== WebSocket.OPEN) return;
      if (this.sent - this.frames / this.figure.fps > this.latency + BACKLOG) { this.stop("The server is too slow for this: choose a run that computes less, or close other programs.", true); return; }
      this.socket.send(data);
      this.sent += data.length / rate;
      this.arrived = performance.now();
      const power = data.reduce((sum, x) => sum + x * x, 0) / data.length / 32768 ** 2;
      this.loudness = clamp(1 + Math.log10(power + 1e-9) / 5, 0, 1);
    };
    this.delay = new DelayNode(context, { maxDelayTime: 20, delayTime: Math.min(20, this.latency + SHOWN_BEHIND) });
    this.gain = new GainNode(context, { gain: at("echo").getAttribute("aria-pressed") === "true" ? 1 : 0 });
    source.connect(capture);
    source.connect(this.delay).connect(this.gain).connect(context.destination);
    context.resume();
    at("waiting").textContent = seconds(this.latency);
    this.become("live");
    this.say("Speak: the figure follows.");
  }

  receive(data) {
    const [first, count] = new Uint32Array(data, 0, 2);
    this.figure.add(first, new Float32Array(data, 8));
    this.frames = first + count;
    this.stage.wake();
  }

  tick(stamp) {
    const elapsed = Math.max((stamp - (this.stamp || stamp)) / 1000, 0);
    this.stamp = stamp;
    const level = this.state === "live" ? this.loudness : 0;
    at("level").firstElementChild.style.transform = `scaleX(${level.toFixed(3)})`;
    at("level").setAttribute("aria-valuenow", Math.round(100 * level));
    if (this.state !== "live") { this.stamp = 0; return false; }
    if (this.frames) {
      this.stage.time = this.playhead.advance(elapsed, this.figure.newest);
      // Since its last piece, the microphone has gone on.
      const now = this.sent + Math.min((performance.now() - this.arrived) / 1000, 0.5), behind = now - this.stage.time;
      this.behind = this.behind ? mix(this.behind, behind, 1 - Math.exp(-elapsed / 0.4)) : behind;
      this.interval = mix(this.interval, elapsed, 1 - Math.exp(-elapsed));
      this.explain(this.behind - this.latency);
      this.delay.delayTime.setTargetAtTime(clamp(this.behind, 0, 20), this.context.currentTime, 1);
      this.write("behind", seconds(this.behind));
      this.write("frames", String(this.frames));
    } else if (this.sent) this.write("behind", "–");
    return true;
  }

  // The reason for a delay that is longer than what the model waits, until it is gone.
  explain(late) {
    if (this.late ? late > LATE - 0.5 : late <= LATE) return;
    this.late = !this.late;
    if (!this.late) this.say("Speak: the figure follows.");
    else if (this.interval > FEW) this.say("This computer draws too slowly: make the window smaller.", true);
    else this.say("The frames arrive late: the server or the connection is slow.", true);
  }

  write(id, text) { if (at(id).textContent !== text) at(id).textContent = text; }

  stop(text, trouble = false) {
    this.attempt = null;
    if (this.socket) this.socket.close(1000);
    if (this.microphone) for (const track of this.microphone.getTracks()) track.stop();
    if (this.context) this.context.close().catch(() => {});
    this.socket = this.microphone = this.context = this.gain = this.refused = null;
    this.behind = this.interval = 0;
    this.late = false;
    this.become("idle");
    this.say(text, trouble);
  }
}

const live = new Live();
// For tests and pictures.
window.a2gLive = {
  ready: live.ready,
  state: () => live.state,
  frames: () => live.frames,
  behind: () => live.behind,
  time: () => live.stage.time,
  newest: () => live.stage.figure.newest,
  interval: () => live.interval,
  scale: () => live.stage.renderer.scale,
  pose: () => Array.from(live.stage.figure.pose),
  renderer: () => live.stage.renderer.name,
};
