// Plots of a run over time on a canvas, which fill as the film runs.

const PLOT_HEIGHT = 170;
const INSET = { left: 58, right: 12, top: 10, bottom: 24 };
const ZERO_RTOL = 1e-6; // Smaller values, as a share of the largest one, are shown as zero.
const ROUND_OFF = { m: 1e-13, "m/s": 1e-12, J: 1e-20, Pa: 1 }; // Values below them are shown as zero.
const POINTS_MAX = 2000; // Corners of a drawn curve.
const CURVES_MAX = 5; // Curves of a plot, each in its own colour.
const SHARE_SHOWN = 0.98; // Share of the values after a rigid impact that the scale shows.
const PEAK_FACTOR = 1.5; // Peaks that are larger than the others, by this factor, are cut off.
const BEFORE_FACTOR = 3; // A run before is cut off where it is larger, by this factor.
const LIMIT_FACTOR = 3; // Limits that are farther from the values, by this factor, are not drawn.
const FIXED_UNITS = {
  Pa: { factor: 1e-6, shown: "MPa" },
  rad: { factor: 180 / Math.PI, shown: "deg" },
  "rad/s": { factor: 180 / Math.PI, shown: "deg/s" },
}; // Other units get a prefix of SI.

// Return the plots of a mechanism: title, unit, and series with the columns of a run.  A plot may have
// limits, which are lines with a label and a value, and a note below it.
function plotList(description, column) {
  const known = new Set(description.outputs.map((output) => output.name));
  const { release } = description;
  const vertical = Math.abs(unitVector(release.direction)[1]) > 0.5;
  const axis = vertical ? "y" : "x";
  const series = (name, label, extra = {}) => ({ label, column: column.get(name), ...extra });
  const moving = description.bodies.slice(0, 4).map((body) => body.name);
  const bodies = (suffix) =>
    moving.map((body) => series(`${body}.${suffix}`, `${words(body)} ${suffix}`));
  const energies = ["kinetic", "elastic", "gravitational", "dissipated", "work"];
  const displacements = [
    { title: "Displacement", unit: "m", series: bodies(axis), walls: axis },
    { title: "Velocity", unit: "m/s", series: bodies(`v${axis}`) },
  ];
  const rotations = [
    { title: "Rotation", unit: "rad", series: bodies("angle") },
    { title: "Angular velocity", unit: "rad/s", series: bodies("omega") },
  ];
  const plots = [
    ...(release.start === "angle" ? rotations : displacements),
    { title: "Energy", unit: "J", series: energies.map((name) => series(`energy.${name}`, name)) },
  ];
  const curves = (parts, output, label) =>
    parts
      .filter(({ name }) => known.has(`${name}.${output}`))
      .map(({ name }) => series(`${name}.${output}`, `${words(name)}${label}`));
  const { stops, flexures } = description;
  const peaks = curves(stops, "peak_force", " peak");
  const forces = [...curves(stops, "force", ""), ...peaks].slice(0, CURVES_MAX);
  if (forces.length > 0) {
    const title = peaks.length > 0 ? "Contact force" : "Contact force at rest";
    plots.push({ title, unit: "N", series: forces });
  }
  const rigid = new Set(
    [...stops.keys()].filter((k) => !known.has(`${stops[k].name}.peak_force`)),
  );
  const stresses = curves(flexures, "stress", "");
  if (stresses.length > 0) {
    plots.push({
      title: "Stress",
      unit: "Pa",
      series: stresses.slice(0, CURVES_MAX),
      limits: yieldStrengths(flexures),
      rigid,
      note:
        "Largest stress of each flexure at each time." +
        (stresses.length > CURVES_MAX ? ` First ${CURVES_MAX} of ${stresses.length}.` : "") +
        (rigid.size > 0
          ? " After a rigid impact it depends on the flexure model: compare several."
          : ""),
    });
  }
  return plots;
}

// Return the different yield strengths of flexures, as lines of a plot.
function yieldStrengths(flexures) {
  const found = new Set(flexures.map((flexure) => flexure.yield).filter(Boolean));
  return [...found].map((value) => ({ label: `yield strength ${stressText(value)}`, value }));
}

const stressText = (stress) => quantityText(stress, FIXED_UNITS.Pa, 3);

// The names of the outputs that the plots show.
function plottedOutputs(description) {
  const known = new Set(description.outputs.map((output) => output.name));
  const names = new Map();
  const column = { get: (name) => names.set(name, true) && 0 };
  plotList(description, column);
  return [...names.keys()].filter((name) => known.has(name));
}

// Return the largest value up to a row, or the value that a share of the later ones does not exceed
// if it is larger.
function mostly(run, columns, row) {
  const later = run.count - row - 1;
  const values = new Float64Array(columns.length * later);
  let before = 0;
  columns.forEach((column, k) => {
    for (let i = 0; i <= row; i++) {
      before = Math.max(before, run.at(i, column));
    }
    for (let i = 0; i < later; i++) {
      values[k * later + i] = run.at(row + 1 + i, column);
    }
  });
  values.sort();
  return Math.max(before, values[Math.floor(SHARE_SHOWN * (values.length - 1))] ?? 0);
}

// Return the least and the largest value of a column in a span of time, or in the whole run, zero
// included.
function range(run, column, [from, to] = [0, Infinity]) {
  let [low, high] = [0, 0];
  const last = Math.min(run.count - 1, Math.ceil(to / run.step));
  for (let row = Math.floor(from / run.step); row <= last; row++) {
    const x = run.at(row, column);
    low = x < low ? x : low;
    high = x > high ? x : high;
  }
  return [low, high];
}

class Plot {
  // Parameters: the plot (see plotList), the parent element, and the function seek(time).
  constructor(plot, parent, seek) {
    this.plot = plot;
    this.canvas = element("canvas", { height: PLOT_HEIGHT, role: "img", tabindex: -1 });
    this.reading = element("span", { class: "reading" });
    const keys = plot.series.map((series, k) =>
      element("span", { class: "key" }, element("i", { class: `swatch s${k}` }), series.label),
    );
    this.limits = plot.limits ?? [];
    const limits = this.limits.map(({ label }) =>
      element("span", { class: "key" }, element("i", { class: "swatch limit" }), label),
    );
    const head = element(
      "div",
      { class: "plot-head" },
      element("h3", {}, plot.title),
      element("span", { class: "keys" }, ...keys, ...limits),
      this.reading,
    );
    this.keys = keys;
    this.card = element("figure", { class: "card plot" }, head, this.canvas);
    if (plot.note) {
      this.card.append(element("figcaption", { class: "hint" }, plot.note));
    }
    this.cut = element("span", { class: "key cut" });
    head.querySelector(".keys").append(this.cut);
    parent.append(this.card);
    this.seek = seek;
    this.listen();
  }

  listen() {
    const time = (event) => {
      const box = this.canvas.getBoundingClientRect();
      const share =
        (event.clientX - box.left - INSET.left) / (box.width - INSET.left - INSET.right);
      const [from, to] = this.span;
      return from + Math.min(1, Math.max(0, share)) * (to - from);
    };
    this.canvas.addEventListener("pointerdown", (event) => {
      this.canvas.setPointerCapture(event.pointerId);
      this.seek(time(event));
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (event.buttons) {
        this.seek(time(event));
      }
    });
  }

  // Draw the run up to the time of the film in full colours, and the rest of it in pale ones.
  // walls: the values of lines that are always in sight.  span: the first and the last time that is
  // shown.  before: the run before the last change, drawn in dots, if there is one.
  draw(run, now, walls, span, before) {
    this.span = span;
    const width = this.canvas.clientWidth;
    const ratio = window.devicePixelRatio || 1;
    if (this.canvas.width !== Math.round(width * ratio)) {
      this.canvas.width = Math.round(width * ratio);
    }
    this.canvas.height = Math.round(PLOT_HEIGHT * ratio);
    const pen = this.canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, PLOT_HEIGHT);
    const style = getComputedStyle(document.getElementById("live"));
    this.colour = (name) => style.getPropertyValue(`--${name}`).trim();
    this.setScales(run, walls, width, before);
    this.drawAxes(pen, width);
    this.drawImpacts(pen, run, now);
    this.drawLines(pen, [...walls, ...this.limits.map(({ value }) => value)], width);
    this.drawBefore(pen, before);
    this.drawSeries(pen, run, now);
    this.drawCursor(pen, run, now);
  }

  setScales(run, walls, width, before) {
    const ranges = this.plot.series.map(({ column }) => range(run, column, this.span));
    let low = Math.min(...ranges.map((sides) => sides[0]));
    let high = Math.max(...ranges.map((sides) => sides[1]));
    let largest = Math.max(high, -low);
    if (largest < (ROUND_OFF[this.plot.unit] ?? 0)) {
      [low, high, largest] = [0, 0, 0];
    }
    ranges.forEach(([a, b], k) => {
      this.keys[k].classList.toggle(
        "flat",
        ranges.length > 1 && Math.max(b, -a) <= ZERO_RTOL * largest,
      );
    });
    this.tiny = high === low ? Infinity : ZERO_RTOL * largest;
    high = this.cutPeaks(run, high);
    if (before && high > low) {
      const earlier = this.plot.series.map(({ column }) => range(before, column, this.span));
      const most = BEFORE_FACTOR * Math.max(high, -low);
      low = Math.max(Math.min(low, ...earlier.map(([a]) => a)), -most);
      high = Math.min(Math.max(high, ...earlier.map(([, b]) => b)), most);
    }
    const near = this.limits.map(({ value }) => value).filter((x) => x <= LIMIT_FACTOR * high);
    low = Math.min(low, ...walls);
    high = Math.max(high, ...walls, ...near);
    if (high === low) {
      high = low + 1;
    }
    const { unit } = this.plot;
    this.kind = FIXED_UNITS[unit] ?? prefixed(Math.max(high, -low), unit);
    const room = 0.08 * (high - low);
    this.low = low < 0 ? low - room : low;
    this.high = high > 0 ? high + room : high;
    const inner = width - INSET.left - INSET.right;
    const tall = PLOT_HEIGHT - INSET.top - INSET.bottom;
    const [from, to] = this.span;
    this.x = (time) => INSET.left + (inner * (time - from)) / (to - from);
    this.y = (value) => INSET.top + (tall * (this.high - value)) / (this.high - this.low);
  }

  // Return the largest value to show.  The peaks after a rigid impact depend on the flexure model:
  // they are cut off if they are much larger than all values before it and most values after it.
  // The head of the plot then has the largest one as a number.
  cutPeaks(run, high) {
    this.cut.textContent = "";
    const impact = run.impacts.find(({ stop }) => this.plot.rigid?.has(stop));
    if (!impact) {
      return high;
    }
    if (this.measured !== run || this.rows !== run.count) {
      const columns = this.plot.series.map(({ column }) => column);
      [this.measured, this.rows] = [run, run.count];
      this.most = mostly(run, columns, Math.floor(impact.time / run.step));
    }
    if (this.most <= 0 || high <= PEAK_FACTOR * this.most) {
      return high;
    }
    const kind = FIXED_UNITS[this.plot.unit] ?? prefixed(high, this.plot.unit);
    this.cut.textContent = `peaks to ${quantityText(high, kind, 3)} cut off`;
    return this.most;
  }

  drawAxes(pen, width) {
    pen.font = "12px system-ui, sans-serif";
    pen.fillStyle = this.colour("muted");
    pen.lineWidth = 1;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    const { factor, shown } = this.kind;
    for (const tick of ticks(this.low * factor, this.high * factor, 5)) {
      const y = Math.round(this.y(tick / factor)) + 0.5;
      pen.strokeStyle = this.colour(tick === 0 ? "axis" : "grid");
      pen.beginPath();
      pen.moveTo(INSET.left, y);
      pen.lineTo(width - INSET.right, y);
      pen.stroke();
      pen.fillText(digits(tick).replace("-", "\u2212"), INSET.left - 6, y);
    }
    pen.save();
    pen.translate(12, INSET.top + (PLOT_HEIGHT - INSET.top - INSET.bottom) / 2);
    pen.rotate(-Math.PI / 2);
    pen.textAlign = "center";
    pen.fillText(unitText(shown), 0, 0);
    pen.restore();
    pen.textBaseline = "top";
    const [from, to] = this.span;
    const time = prefixed(to, "s");
    const count = Math.max(3, Math.min(8, width / 90));
    const marks = ticks(from * time.factor, to * time.factor, count);
    for (const [k, tick] of marks.entries()) {
      const x = this.x(tick / time.factor);
      const last = k === marks.length - 1;
      pen.textAlign = last ? "right" : "center";
      const label = last ? `${digits(tick)} ${time.shown}` : digits(tick);
      pen.fillText(label, last ? Math.min(width - 2, x + 10) : x, PLOT_HEIGHT - INSET.bottom + 6);
    }
  }

  drawImpacts(pen, run, now) {
    const [from, to] = this.span;
    for (const impact of run.impacts.filter(({ time }) => from <= time && time <= to)) {
      const x = this.x(impact.time);
      pen.strokeStyle = this.colour("impact");
      pen.globalAlpha = impact.time <= now ? 0.55 : 0.15;
      pen.beginPath();
      pen.moveTo(x, INSET.top);
      pen.lineTo(x, PLOT_HEIGHT - INSET.bottom);
      pen.stroke();
    }
    pen.globalAlpha = 1;
  }

  drawLines(pen, lines, width) {
    pen.strokeStyle = this.colour("wall");
    pen.setLineDash([5, 4]);
    for (const line of lines.filter((value) => value <= this.high)) {
      pen.beginPath();
      pen.moveTo(INSET.left, this.y(line));
      pen.lineTo(width - INSET.right, this.y(line));
      pen.stroke();
    }
    pen.setLineDash([]);
  }

  drawSeries(pen, run, now) {
    const [first, last] = this.rowsShown(run);
    const every = Math.max(1, Math.floor((last - first) / POINTS_MAX));
    const end = Math.max(first, Math.min(last, Math.floor(now / run.step)));
    this.clip(pen);
    pen.lineWidth = 1.8;
    pen.lineJoin = "round";
    this.plot.series.forEach(({ column }, k) => {
      pen.strokeStyle = this.colour(`s${k}`);
      const stroke = (from, to, alpha) => {
        pen.globalAlpha = alpha;
        pen.beginPath();
        for (let row = from; row <= to; row += every) {
          pen.lineTo(this.x(row * run.step), this.y(run.at(row, column)));
        }
        pen.stroke();
      };
      stroke(end, last, 0.22);
      stroke(first, end, 1);
    });
    pen.restore();
  }

  // Draw the curves of the run before the last change in dots.
  drawBefore(pen, before) {
    if (!before) {
      return;
    }
    const [first, last] = this.rowsShown(before);
    const every = Math.max(1, Math.floor((last - first) / POINTS_MAX));
    this.clip(pen);
    pen.lineWidth = 1.2;
    pen.globalAlpha = 0.7;
    pen.setLineDash([2, 3]);
    this.plot.series.forEach(({ column }, k) => {
      pen.strokeStyle = this.colour(`s${k}`);
      pen.beginPath();
      for (let row = first; row <= last; row += every) {
        pen.lineTo(this.x(row * before.step), this.y(before.at(row, column)));
      }
      pen.stroke();
    });
    pen.restore();
  }

  // Return the first and the last row of a run in the span that is shown, and beside it.
  rowsShown(run) {
    const [from, to] = this.span;
    const last = Math.min(run.count - 1, Math.ceil(to / run.step));
    return [Math.max(0, Math.min(last, Math.floor(from / run.step))), last];
  }

  // Keep a pen within the axes, until it is restored.
  clip(pen) {
    const width = this.canvas.clientWidth - INSET.left - INSET.right;
    pen.save();
    pen.beginPath();
    pen.rect(INSET.left - 2, INSET.top - 2, width + 4, PLOT_HEIGHT);
    pen.clip();
  }

  drawCursor(pen, run, now) {
    const row = Math.min(run.count - 1, Math.round(now / run.step));
    const x = this.x(Math.min(now, run.time));
    pen.strokeStyle = this.colour("text");
    pen.lineWidth = 1;
    pen.beginPath();
    pen.moveTo(x, INSET.top);
    pen.lineTo(x, PLOT_HEIGHT - INSET.bottom);
    pen.stroke();
    const texts = this.plot.series.map(({ column }, k) => {
      pen.fillStyle = this.colour(`s${k}`);
      pen.beginPath();
      pen.arc(x, this.y(Math.min(run.at(row, column), this.high)), 3.5, 0, 2 * Math.PI);
      pen.fill();
      const value = run.at(row, column);
      return quantityText(Math.abs(value) > this.tiny ? value : 0, this.kind, 3);
    });
    this.reading.textContent = texts.length === 1 ? texts[0] : "";
    this.canvas.setAttribute("aria-label", `${this.plot.title} over time`);
  }
}
