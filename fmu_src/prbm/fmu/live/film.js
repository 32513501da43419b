// The film of a run: its time, speed, and buttons.

const SPEEDS = [1, 2, 5, 10, 20, 50, 100]; // Slow motion, in units of a power of ten.
const FILM_SECONDS = 10; // Duration of the film at the speed that is chosen first.

const reducedMotion = window.matchMedia("(prefers-reduced-motion: reduce)");

class Film {
  // Parameters: the duration of a run [s], and the function changed() that draws the new time.
  constructor(stopTime, changed) {
    this.stopTime = stopTime;
    this.changed = changed;
    this.now = 0;
    this.playing = false;
    this.available = 0; // Time up to which the run has been computed [s].
    this.nodes = {
      play: byId("play"),
      restart: byId("restart"),
      scrub: byId("scrub"),
      speed: byId("speed"),
    };
    this.listSpeeds();
    this.listen();
  }

  // Take another duration [s], with speeds that suit it.
  setDuration(stopTime) {
    this.stopTime = stopTime;
    this.nodes.speed.replaceChildren();
    this.listSpeeds();
  }

  listSpeeds() {
    const best = FILM_SECONDS / this.stopTime;
    const power = 10 ** Math.floor(Math.log10(best) - 1);
    const factors = SPEEDS.map((k) => Number((k * power).toPrecision(3)));
    const near = (x) => Math.abs(Math.log(x / best));
    this.slow = factors.reduce((a, b) => (near(b) < near(a) ? b : a));
    for (const factor of factors) {
      const text =
        factor === 1
          ? "real time"
          : factor > 1
            ? `1/${digits(factor)}`
            : `${digits(1 / factor)}\u00d7`;
      const option = element("option", { value: factor }, text);
      option.selected = factor === this.slow;
      this.nodes.speed.append(option);
    }
  }

  listen() {
    const { play, restart, scrub, speed } = this.nodes;
    play.addEventListener("click", () => this.toggle());
    restart.addEventListener("click", () => this.replay());
    scrub.addEventListener("input", () =>
      this.seek((Number(scrub.value) / Number(scrub.max)) * this.stopTime),
    );
    speed.addEventListener("change", () => {
      this.slow = Number(speed.value);
    });
    // The space key belongs to the page unless the drawing or the time has the focus.
    document.addEventListener("keydown", (event) => {
      if (event.key === " " && event.target.closest("#stage, #scrub")) {
        event.preventDefault();
        this.toggle();
      }
    });
  }

  toggle() {
    if (!this.playing && this.now >= this.stopTime) {
      this.now = 0;
    }
    this.play(!this.playing);
  }

  replay() {
    this.now = 0;
    this.play(true);
  }

  seek(time) {
    this.play(false);
    this.now = Math.min(time, this.available);
    this.changed();
  }

  play(playing) {
    const started = playing && !this.playing;
    this.playing = playing;
    this.nodes.play.textContent = playing ? "Pause" : "Play";
    this.nodes.play.setAttribute("aria-label", playing ? "Pause" : "Play");
    this.changed();
    if (started) {
      this.before = performance.now();
      requestAnimationFrame((time) => this.frame(time));
    }
  }

  frame(time) {
    if (!this.playing) {
      return;
    }
    const elapsed = Math.min(0.1, Math.max(0, (time - this.before) / 1000));
    this.before = time;
    this.now = Math.min(this.now + elapsed / this.slow, this.available);
    if (this.now >= this.stopTime) {
      this.play(false);
      return;
    }
    this.changed();
    requestAnimationFrame((next) => this.frame(next));
  }

  // Show the time in the controls.
  show() {
    const { scrub } = this.nodes;
    scrub.value = Math.round((Number(scrub.max) * this.now) / this.stopTime);
    scrub.setAttribute("aria-valuetext", timeText(this.now, this.stopTime));
  }
}
