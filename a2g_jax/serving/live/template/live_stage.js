// The stage with one figure; the renderer, the camera and the layout are those of the written page.

class LiveStage {
  constructor() {
    this.stage = document.getElementById("stage");
    this.scheme = matchMedia("(prefers-color-scheme: dark)");
    this.renderer = makeRenderer(document.getElementById("view"), location.hash !== "#2d");
    this.pace = new Pace(this.renderer);
    this.camera = { ...START };
    this.bands = [];
    this.figure = null;
    this.time = 0;
    this.trails = false;
    attachCamera(document.getElementById("view"), this);
    for (const button of document.querySelectorAll("[data-view]")) button.addEventListener("click", () => this.view(VIEWS[button.dataset.view]));
    this.scheme.addEventListener("change", () => this.wake());
    new ResizeObserver(() => { this.stale = true; this.wake(); }).observe(this.stage);
  }

  show(figure) { this.figure = figure; this.stale = true; this.time = 0; this.wake(); }

  view(change) { Object.assign(this.camera, change); this.wake(); }

  // A picture of the latest state once the one before is complete. `ticking`, if set, is called before each picture and
  // returns whether another one follows.
  wake() {
    this.wanted = true;
    if (this.drawing) return;
    this.drawing = true;
    requestAnimationFrame((stamp) => {
      this.wanted = this.ticking ? this.ticking(stamp) : false;
      clearTimeout(this.settling);
      this.pace.picture(() => this.draw(false), () => {
        this.drawing = false;
        if (this.wanted) this.wake();
        // A picture that stays a while is drawn again at full quality, where the moving one is simpler.
        else if (this.renderer.software || this.renderer.scale < 1) this.settling = setTimeout(() => this.draw(true), 400);
      });
    });
  }

  draw(still) {
    const width = this.stage.clientWidth, height = this.stage.clientHeight;
    if (!this.figure || width < 2 || height < 2) return;
    if (this.stale) { this.bands = arrange([this.figure], [0], false, width, height); this.stale = false; }
    const theme = THEMES[this.scheme.matches ? "dark" : "light"], [band] = this.bands, { figure } = this;
    placeCamera(band, this.camera);
    figure.update(this.time, this.camera.yaw, band.slots[0], theme, this.trails);
    band.figures = [figure.drawn];
    const ratio = Math.min(window.devicePixelRatio || 1, 2), moving = this.renderer.scale;
    if (still) this.renderer.scale = this.renderer.software && ratio < 2 ? 2 : 1;
    this.renderer.render({ bands: this.bands, width, height, ratio, theme, yaw: this.camera.yaw, overlay: false, still });
    this.renderer.scale = moving;
  }
}
