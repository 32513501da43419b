// The live page: a simulation for the present parameters, its film, plots, tables and link.

const RUN_AGE_MIN = 120; // Milliseconds that a run gets before a drag replaces it.
const RUN_TIME_UNNOTICED = 500; // Milliseconds after which the page shows how much is computed.
const PLOT_PERIOD = 50; // Milliseconds between two drawings of the plots while the film runs.
const RUN_ROWS_MAX = 20000; // Rows of a run; a longer one has longer steps between them.
const ZOOM_FACTOR = 2; // Of the time axis, with each press of a button.
const ZOOM_MAX = 1000;

class Page {
  constructor(description, kernel, tables) {
    this.description = description;
    this.kernel = kernel;
    this.mechanism = kernel.mechanism(tables);
    this.known = new Map(description.quantities.map((quantity) => [quantity.name, quantity]));
    this.changes = new Map();
    this.outputs = plottedOutputs(description);
    description.stops.forEach((stop) =>
      this.outputs.push(
        `${stop.name}.contact`,
        `${stop.name}.impact_count`,
        `${stop.name}.impact_time`,
      ),
    );
    const slot = new Map(description.outputs.map((output) => [output.name, output.slot]));
    for (const output of ["peak_stress", "stress"]) {
      const stresses = description.flexures.map(({ name }) => `${name}.${output}`);
      const wanted = stresses.filter((name) => slot.has(name) && !this.outputs.includes(name));
      this.outputs.push(...wanted);
    }
    this.slots = this.outputs.map((name) => slot.get(name));
    const stops = [...description.stops.keys()];
    this.rigid = new Set(stops.filter((k) => !slot.has(`${description.stops[k].name}.peak_force`)));
    this.column = new Map(this.outputs.map((name, k) => [name, k]));
    this.run = null;
    this.before = null; // Run and shapes before the last change.
    this.runs = 0;
    this.stopTime = description.stopTime;
    this.zoom = 1;
    this.build();
  }

  build() {
    const { description } = this;
    const actions = {
      quantity: (name) => this.known.get(name),
      value: (name) => this.value(name),
      wall: (k) => this.wall(k),
      drag: (name, value, ended) => this.dragged(name, value, ended),
      grab: (name) => this.grabbed(name),
    };
    this.film = new Film(description.stopTime, () => this.show());
    this.stage = new Stage(byId("stage"), description, actions);
    this.controls = new Controls(byId("fields"), description, {
      change: (...change) => this.change(...change),
      reject: (...problem) => this.reject(...problem),
    });
    const seek = (time) => this.film.seek(time);
    this.plots = plotList(description, this.column).map(
      (plot) => new Plot(plot, byId("plots"), seek),
    );
    const draw = (shape) => this.stage.draw(this.shapes, shape);
    const wall = (k) => this.wall(k);
    this.modes = new ModeView(byId("modes"), description, draw, wall);
    const handles = [
      ...(description.stops.length ? ["a wall"] : []),
      ...(this.stage.bodyHandle ? ["the released body"] : []),
    ];
    byId("hint").textContent =
      (handles.length ? `Drag ${handles.join(" or ")}; arrow keys move a focused handle. ` : "") +
      "Drag over a plot to move in time.";
    byId("impact-card").hidden = description.stops.length === 0;
    byId("links").hidden = description.flexures.every((flexure) => flexure.beam);
    this.listen();
  }

  listen() {
    byId("reset").addEventListener("click", () => {
      this.setDuration(this.description.stopTime);
      this.apply(new Map(), true);
    });
    byId("duration").addEventListener("change", ({ target }) => this.timed(target.value));
    byId("closer").addEventListener("click", () => this.zoomed(this.zoom * ZOOM_FACTOR));
    byId("farther").addEventListener("click", () => this.zoomed(this.zoom / ZOOM_FACTOR));
    byId("show-before").addEventListener("change", () => this.show(true));
    byId("copy").addEventListener("click", () => this.copy());
    byId("download").addEventListener("click", () => this.download());
    byId("show-links").addEventListener("change", (event) =>
      byId("live").classList.toggle("with-links", event.target.checked),
    );
    window.addEventListener("hashchange", () => this.follow());
    const tabs = [byId("tab-motion"), byId("tab-modes")];
    tabs.forEach((tab, k) => {
      tab.addEventListener("click", () => this.view(k === 1));
      tab.addEventListener("keydown", (event) => {
        if (event.key === "ArrowRight" || event.key === "ArrowLeft") {
          this.view(k === 0);
          tabs[1 - k].focus();
        }
      });
    });
    const resize = () => {
      if (this.shapes && this.stage.bounds) {
        this.stage.resize(this.shapes);
        this.show(true);
      }
    };
    new ResizeObserver(resize).observe(byId("plots"));
    window.addEventListener("resize", resize);
    window
      .matchMedia("(prefers-color-scheme: dark)")
      .addEventListener("change", () => this.show(true));
  }

  // -- values --

  value(name) {
    return this.changes.has(name) ? this.changes.get(name) : this.known.get(name).start;
  }

  values() {
    return new Map([...this.known.keys()].map((name) => [name, this.value(name)]));
  }

  // The position of a wall [m].
  wall(k) {
    const stop = this.description.stops[k];
    return (
      evaluated(stop.position, { get: (name) => this.value(name) }) + this.value(stop.displacement)
    );
  }

  change(name, value, ended) {
    const changes = new Map(this.changes);
    if (Object.is(value, this.known.get(name).start)) {
      changes.delete(name);
    } else {
      changes.set(name, value);
    }
    this.touched = name;
    this.apply(changes, ended);
  }

  dragged(name, value, ended) {
    this.change(name, value, ended);
    if (ended && name === this.description.release.quantity && !reducedMotion.matches) {
      this.film.replay();
    }
  }

  grabbed(name) {
    if (this.modes.active) {
      this.view(false);
    }
    if (name === this.description.release.quantity) {
      this.film.seek(0);
    }
  }

  // -- time --

  // The duration, if it is not the default one, else null.
  get ownDuration() {
    return this.stopTime === this.description.stopTime ? null : this.stopTime;
  }

  // Take a duration [s], and show it in its field.
  setDuration(stopTime) {
    this.stopTime = stopTime;
    this.film.setDuration(stopTime);
    const kind = prefixed(this.description.stopTime, "s");
    byId("duration").value = digits(stopTime * kind.factor, 7);
    byId("duration-unit").textContent = unitText(kind.shown);
    this.zoomed(1);
  }

  // Take the text of the field of the duration.
  timed(text) {
    const kind = prefixed(this.description.stopTime, "s");
    const x = parsed(withoutUnit(text, kind)) / kind.factor;
    if (!(x > 0 && Number.isFinite(x))) {
      this.say(`The duration \u201c${text.trim()}\u201d is not a positive number in ${kind.shown}.`);
      return;
    }
    this.setDuration(x);
    this.wanted ??= this.changes;
    this.begin();
  }

  // The number of steps between the rows of a run, and their size [s].
  get steps() {
    const usual = this.description.stopTime / this.description.step;
    const wanted = this.stopTime / this.description.step;
    const count = Math.round(Math.min(Math.max(usual, wanted), Math.max(usual, RUN_ROWS_MAX)));
    return [count, count === Math.round(wanted) ? this.description.step : this.stopTime / count];
  }

  // Show a share of the time axis, about the present time.
  zoomed(zoom) {
    this.zoom = Math.min(Math.max(zoom, 1), ZOOM_MAX);
    const length = this.stopTime / this.zoom;
    this.from = Math.min(Math.max(this.film.now - length / 2, 0), this.stopTime - length);
    byId("closer").disabled = this.zoom >= ZOOM_MAX;
    byId("farther").disabled = this.zoom === 1;
    this.show(true);
  }

  // The span of time that the plots show; it follows the film.
  span(now) {
    const length = this.stopTime / this.zoom;
    if (now < this.from || now > this.from + length) {
      this.from = Math.min(Math.max(now - 0.1 * length, 0), this.stopTime - length);
    }
    return [this.from, this.from + length];
  }

  // -- changes --

  // Keep the present run, to show it beside the one with a change.  While a handle or slider moves,
  // the run before its first change is kept.
  keepBefore(ended) {
    if (!this.moving && this.run?.finished && this.before?.run !== this.run) {
      this.before?.shapes.simulation.close();
      this.before = { run: this.run, shapes: this.shapes };
    }
    this.moving = !ended;
  }

  // The run before the last change, if it is shown, else null.
  get shownBefore() {
    const wanted = byId("show-before").checked && this.before?.run !== this.run;
    return wanted ? this.before : null;
  }

  // Start a simulation with changes, at once or when the present one has been shown.
  apply(changes, now) {
    this.keepBefore(now);
    this.wanted = changes;
    if (now || !this.busy || performance.now() - this.started > RUN_AGE_MIN) {
      this.begin();
    }
  }

  follow() {
    const { changes, stopTime, problems } = changesOf(location.hash, this.known);
    this.touched = null;
    const valid = stopTime > 0 && Number.isFinite(stopTime);
    this.setDuration(valid ? stopTime : this.description.stopTime);
    if (stopTime !== null && !valid) {
      problems.push("The link has an invalid duration, which was ignored.");
    }
    this.apply(changes, true);
    if (problems.length) {
      this.say([byId("message").textContent, ...problems].filter(Boolean).join(" "));
    }
  }

  // -- the simulation --

  begin() {
    const changes = this.wanted;
    this.wanted = null;
    let simulation = null;
    let run = null;
    try {
      const numbers = [...changes].map(([name, value]) => [this.known.get(name).slot, value]);
      simulation = new Simulation(this.kernel, this.mechanism, this.slots, new Map(numbers));
      run = new Run(simulation, ...this.steps);
    } catch (error) {
      simulation?.close();
      this.refuse(error, changes);
      return;
    }
    this.stop?.();
    if (this.simulation !== this.before?.shapes.simulation) {
      this.simulation?.close();
    }
    [this.changes, this.simulation, this.run] = [changes, simulation, run];
    this.shapes = new Shapes(this.description, this.values(), simulation);
    this.started = performance.now();
    this.busy = true;
    this.say("");
    this.known.forEach((_, name) => this.controls.show(name, this.value(name)));
    showFragment(changes, this.ownDuration);
    this.state("running");
    this.stop = compute(run, () => this.progress());
    this.show();
    if (!this.played && !reducedMotion.matches) {
      this.played = true;
      this.film.play(true);
    }
    if (this.modes.active) {
      this.modes.open(this.shapes);
    }
  }

  refuse(error, changes) {
    if (!(error instanceof KernelError)) {
      throw error;
    }
    const named = [...changes.keys()].find((name) => ` ${error.message}`.includes(` ${name} = `));
    this.reject(`${error.message}.`, named ?? this.touched);
    if (!this.run) {
      this.state("error");
      if (changes.size) {
        this.wanted = new Map();
        const text = byId("message").textContent;
        this.begin();
        this.say(`${text} The default values are shown instead.`);
      }
    }
  }

  // Show a message about the value of a field that is not simulated; the other fields show theirs.
  reject(text, name) {
    this.known.forEach((_, own) => own !== name && this.controls.show(own, this.value(own)));
    this.say(`${text}${this.run ? " The last valid simulation is still shown." : ""}`, name);
  }

  progress() {
    const { run } = this;
    this.film.available = run.time;
    if (run.finished) {
      this.busy = false;
      this.finish();
    }
    if (run.finished || performance.now() - (this.plotted ?? 0) > PLOT_PERIOD) {
      this.show(true);
    }
    if (this.wanted && (run.finished || performance.now() - this.started > RUN_AGE_MIN)) {
      this.begin();
    }
  }

  finish() {
    const { run, description } = this;
    const { stops } = description;
    const read = (name, output) => run.last(this.column.get(`${name}.${output}`));
    const { dataset } = document.documentElement;
    dataset.impacts = stops.reduce((sum, stop) => sum + read(stop.name, "impact_count"), 0);
    dataset.last = JSON.stringify(
      Object.fromEntries(stops.map((stop) => [stop.name, read(stop.name, "impact_time")])),
    );
    this.runs += 1;
    dataset.runs = this.runs;
    dataset.milliseconds = Math.round(performance.now() - this.started);
    if (run.error) {
      this.say(`${run.error.message}.`);
    }
    this.stage.fit(this.shapes, run);
    this.film.stopTime = run.error ? Math.max(run.time, run.step) : this.stopTime;
    this.state("done");
  }

  state(text) {
    document.documentElement.dataset.state = text;
  }

  say(text, name = null) {
    for (const message of [byId("message"), byId("problem")]) {
      message.textContent = text;
      message.hidden = text === "";
    }
    this.controls.mark(name);
  }

  // -- what is shown --

  // Draw the present time of the film.
  show(whole = false) {
    const { run, film } = this;
    if (!run) {
      return;
    }
    film.available = run.time;
    const now = Math.min(film.now, run.time);
    if (!this.stage.bounds) {
      this.stage.fit(this.shapes, run);
    }
    const before = this.shownBefore;
    byId("before").hidden = !this.before || this.modes.active;
    if (!this.modes.active) {
      this.stage.draw(this.shapes, this.shapes.at(run.coordinates(now)), this.flashes(now));
      const earlier = before && Math.min(now, before.run.time);
      this.stage.drawBefore(
        before && [before.shapes, before.shapes.at(before.run.coordinates(earlier))],
      );
      this.stage.colour(this.stresses(now));
    }
    film.show();
    byId("clock").textContent = timeText(now, this.stopTime);
    const time = performance.now();
    if (whole || !film.playing || time - (this.plotted ?? 0) > PLOT_PERIOD) {
      this.plotted = time;
      this.showNumbers(now);
    }
  }

  showNumbers(now) {
    const { run, description } = this;
    const time = performance.now();
    const span = this.span(now);
    const before = this.shownBefore?.run;
    this.plots.forEach((plot) =>
      plot.draw(run, now, plot.plot.walls ? this.wallLines() : [], span, before),
    );
    const key = `${this.runs} ${run.count} ${this.started}`;
    if (key !== this.listed) {
      this.listed = key;
      const pairs = headline(description, run, this.column);
      showHeadline(byId("headline"), pairs);
      const slow = !run.finished && time - this.started > RUN_TIME_UNNOTICED;
      const share = Math.floor((100 * run.count) / run.steps);
      byId("brief").textContent =
        (slow ? `Computing, ${share}\u202f% done \u00b7 ` : "") + brief(pairs);
      showImpacts(byId("impacts"), description, run, (time) => this.film.seek(time));
    }
  }

  // The stress of each flexure at a time, as a share of the largest one of the run, which is shown
  // beside the drawing; null without stress outputs.
  stresses(now) {
    const { run, description } = this;
    const columns = description.flexures.map(({ name }) => this.column.get(`${name}.stress`));
    const known = columns.filter((column) => column !== undefined);
    const key = byId("stress-key");
    key.hidden = known.length === 0;
    if (known.length === 0) {
      return null;
    }
    if (this.coloured !== run || this.colouredRows !== run.count) {
      [this.coloured, this.colouredRows] = [run, run.count];
      const impact = run.impacts.find(({ stop }) => this.rigid.has(stop));
      const row = impact ? Math.floor(impact.time / run.step) : run.count - 1;
      this.most = mostly(run, known, row);
      key.textContent = `stress 0 to ${stressText(this.most)}`;
    }
    const row = Math.min(run.count - 1, Math.round(now / run.step));
    return columns.map((column) =>
      column === undefined || this.most <= 0 ? 0 : Math.min(1, run.at(row, column) / this.most),
    );
  }

  // The positions of the walls on the ground, as displacements along the plotted axis [m].
  wallLines() {
    const { stops, release } = this.description;
    const axis = Math.abs(unitVector(release.direction)[1]) > 0.5 ? 1 : 0;
    return stops.flatMap((stop, k) => {
      const along = unitVector(stop.direction)[axis];
      return stop.on === GROUND && Math.abs(along) > 0.99 ? [this.wall(k) * along] : [];
    });
  }

  // The impacts that have just happened at a time of the film.
  flashes(now) {
    const { run, film } = this;
    const marks = [];
    const strongest = Math.max(...run.impacts.map((impact) => impact.approach), 1e-30);
    const length = FLASH_TIME / film.slow;
    for (let k = run.impactAfter(now) - 1; k >= 0 && run.impacts[k].time > now - length; k--) {
      const { stop, time, approach } = run.impacts[k];
      marks.push({
        stop,
        age: (now - time) / length,
        strength: Math.max(0.25, approach / strongest),
      });
    }
    return reducedMotion.matches ? [] : marks;
  }

  view(modes) {
    byId("tab-motion").setAttribute("aria-selected", String(!modes));
    byId("tab-modes").setAttribute("aria-selected", String(modes));
    byId("tab-motion").tabIndex = modes ? -1 : 0;
    byId("tab-modes").tabIndex = modes ? 0 : -1;
    byId("live").classList.toggle("modal", modes);
    byId("transport").hidden = modes;
    byId("clock").hidden = modes;
    if (modes && !this.modes.active) {
      this.film.play(false);
      this.stage.drawBefore(null);
      this.stage.colour(null);
      this.modes.open(this.shapes);
      this.show();
    } else if (!modes) {
      this.modes.close();
      this.show();
    }
  }

  // -- results --

  async copy() {
    const link = linkWith(this.changes, this.ownDuration);
    try {
      await navigator.clipboard.writeText(link);
      byId("done").textContent = "Link copied.";
    } catch {
      byId("done").textContent = link;
    }
  }

  // Simulate again with all outputs, and save them as CSV.
  download() {
    const { outputs, name } = this.description;
    const numbers = [...this.changes].map(([key, value]) => [this.known.get(key).slot, value]);
    const slots = outputs.map((output) => output.slot);
    const simulation = new Simulation(this.kernel, this.mechanism, slots, new Map(numbers));
    const run = new Run(simulation, ...this.steps);
    byId("done").textContent = "Computing all outputs\u2026";
    compute(run, () => {
      if (run.finished) {
        save(`${name}.csv`, table(run, outputs));
        simulation.close();
        byId("done").textContent = "Saved.";
      }
    });
  }
}

// Return the rows of a run as CSV, in SI units with all digits.
function table(run, outputs) {
  const lines = [["time", ...outputs.map((output) => output.name)].join(",")];
  for (let row = 0; row < run.count; row++) {
    const numbers = run.rows.subarray(row * run.width, (row + 1) * run.width);
    lines.push([row * run.step, ...numbers].join(","));
  }
  return `${lines.join("\n")}\n`;
}

function save(name, text) {
  const address = URL.createObjectURL(new Blob([text], { type: "text/csv" }));
  element("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
}

// Return the bytes that an element holds, compressed by gzip, as base64.
async function unpacked(id) {
  const packed = Uint8Array.from(atob(byId(id).textContent), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

async function open() {
  document.documentElement.dataset.state = "loading";
  const description = JSON.parse(byId("live-content").textContent);
  const [tables, bytes] = await Promise.all([unpacked("live-tables"), unpacked("live-module")]);
  const kernel = await Kernel.compile(bytes);
  byId("live").hidden = false;
  const page = new Page(description, kernel, tables);
  page.follow();
}

open().catch((error) => {
  document.documentElement.dataset.state = "error";
  byId("live").hidden = true;
  const remedy = "open the page in a current version of Chrome, Edge, Firefox or Safari";
  const text = `The simulation does not run in this browser (${error.message}): ${remedy}.`;
  byId("live").before(element("p", { class: "message", role: "alert" }, text));
  console.error(error);
});
