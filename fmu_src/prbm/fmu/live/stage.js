// The drawing of the mechanism as SVG: flexures, bodies, ground, and handles to drag.

const MARGIN = 34; // Pixels around the motion.
const HEIGHT_MAX = 0.5; // Of the window: the controls below the drawing are in view with it.
const FOOT = 16; // Further pixels below it, for the scale.
const FLASH_TIME = 0.35; // Seconds of the film in which the mark of an impact fades.
const HATCH_PITCH = 11; // Pixels between two strokes of a hatching.
const HATCHES_MIN = 4; // Strokes of a hatching.
const HANDLE_OFFSET = [14, 15]; // Pixels of a handle behind its wall and beyond the end of the wall.
const BOUND_SHAPES = 60; // Shapes of a run that determine the size of the drawing.
const KEY_STEPS = 100; // Key strokes from one end of a slider to the other.
const ARROWS = { ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowLeft: [-1, 0], ArrowDown: [0, -1] };
const ACROSS_RTOL = 0.1; // A smaller share of a key's direction is across the path of a handle.

class Stage {
  // Parameters: the SVG element, the description of the page, and the functions
  // drag(name, value, ended) and grab() that are called while a handle moves.
  constructor(svg, description, actions) {
    this.svg = svg;
    this.description = description;
    this.actions = actions;
    this.layers = {};
    for (const name of [
      "ground",
      "straight",
      "before",
      "flexures",
      "bodies",
      "links",
      "walls",
      "marks",
      "handles",
      "scale",
    ]) {
      this.layers[name] = drawn("g", { class: `layer-${name}` });
      svg.append(this.layers[name]);
    }
    this.bounds = null;
    this.build();
  }

  build() {
    const { bodies, flexures, stops } = this.description;
    const add = (layer, tag, attributes) => {
      const node = drawn(tag, attributes);
      this.layers[layer].append(node);
      return node;
    };
    this.straight = flexures.map(() => add("straight", "path", { class: "straight" }));
    this.before = [...flexures, ...bodies].map(() => add("before", "path", { class: "before" }));
    this.flexures = flexures.map(({ profile }) =>
      add("flexures", "path", { class: profile ? "flexure shaped" : "flexure" }),
    );
    this.links = flexures.map(() => add("links", "path", { class: "link" }));
    this.pivots = flexures.map(() => add("links", "path", { class: "pivot" }));
    this.bodies = bodies.map((body) => {
      const node = add("bodies", "path", { class: "body" });
      node.append(drawn("title", {}, body.name));
      return node;
    });
    this.centres = bodies.map(() => add("bodies", "path", { class: "centre" }));
    this.springs = add("bodies", "path", { class: "spring" });
    this.pins = add("bodies", "path", { class: "pin" });
    this.probes = add("marks", "path", { class: "probe" });
    this.walls = stops.map(() => add("walls", "path", { class: "wall" }));
    this.hits = stops.map(() => add("marks", "circle", { class: "hit", r: 3 }));
    this.flashes = stops.map(() => add("marks", "circle", { class: "flash", r: 0 }));
    this.fixed = add("ground", "path", { class: "fixed" });
    this.ground = add("ground", "path", { class: "ground" });
    this.scale = add("scale", "path", { class: "scale" });
    this.scaleText = add("scale", "text", { class: "scale-text", "text-anchor": "middle" });
    this.wallHandles = stops.map((stop) =>
      this.handle(stop.quantity, `Wall of ${words(stop.name)}`, "wall-handle"),
    );
    const { release } = this.description;
    this.bodyHandle = release.quantity
      ? this.handle(release.quantity, `Released ${words(release.body)}`, "body-handle")
      : null;
  }

  // Add a handle, which is a slider for assistive technology.
  handle(name, label, kind) {
    const quantity = this.actions.quantity(name);
    const node = drawn(
      "g",
      { class: `handle ${kind}`, role: "slider", tabindex: 0, "aria-label": `${label}: ${name}` },
      drawn("circle", { class: "target", r: 22 }),
      drawn("circle", { class: "grip", r: 11 }),
      drawn("path", { class: "arrows", d: "M-3,-4 l-4,4 l4,4 M3,-4 l4,4 l-4,4" }),
      drawn("title", {}, `${name}: drag, or use the arrow keys`),
    );
    this.layers.handles.append(node);
    node.addEventListener("keydown", (event) => this.keyed(event, node, quantity));
    node.addEventListener("pointerdown", (event) => this.dragged(event, node, name));
    return node;
  }

  // Move a handle in the direction of an arrow key.  A key across its path changes the value: up and
  // right increase it.
  keyed(event, node, { name, slider }) {
    const arrow = ARROWS[event.key];
    if (arrow === undefined) {
      return;
    }
    event.preventDefault();
    const [x, y] = [0, 1].map((axis) => arrow[axis] * node.along[axis]);
    const across = Math.abs(x + y) < ACROSS_RTOL * norm(node.along);
    const sign = Math.sign(across ? arrow[0] + arrow[1] : x + y);
    const step = ((slider.high - slider.low) / KEY_STEPS) * (event.shiftKey ? 5 : 1);
    this.actions.drag(name, rounded(this.actions.value(name) + sign * step, step / 10), true);
  }

  dragged(event, node, name) {
    event.preventDefault();
    node.focus({ preventScroll: true });
    node.setPointerCapture(event.pointerId);
    node.classList.add("dragging");
    const start = this.world(event);
    const value = this.actions.value(name);
    const along = node.along;
    const fine = (0.25 / this.pixels) * norm(along);
    this.actions.grab(name);
    this.holding = true;
    const amount = (moved) => {
      const [x, y] = minus(this.world(moved), start);
      return rounded(value + x * along[0] + y * along[1], fine);
    };
    const move = (moved) => this.actions.drag(name, amount(moved), false);
    const end = (moved) => {
      node.classList.remove("dragging");
      this.holding = false;
      node.removeEventListener("pointermove", move);
      node.removeEventListener("pointerup", end);
      node.removeEventListener("pointercancel", end);
      this.actions.drag(name, amount(moved), true);
    };
    node.addEventListener("pointermove", move);
    node.addEventListener("pointerup", end);
    node.addEventListener("pointercancel", end);
  }

  // Return the position of a pointer in metres.
  world(event) {
    const box = this.svg.getBoundingClientRect();
    return [
      (event.clientX - box.left - this.origin[0]) / this.pixels,
      -(event.clientY - box.top - this.origin[1]) / this.pixels,
    ];
  }

  // -- size --

  // Choose the part of the plane that is shown, from the shapes of a run and the walls.
  fit(shapes, run) {
    if (this.bounds && this.holding) {
      return; // The drawing keeps its scale below a pointer.
    }
    const points = this.description.groundParts.flatMap(([outline]) =>
      outline.map((corner) => pointOf(corner, shapes.values)),
    );
    const every = Math.max(1, Math.floor(run.count / BOUND_SHAPES));
    for (let row = 0; row < run.count; row += every) {
      const shape = shapes.at(run.node(row).q);
      points.push(
        ...shape.lines.flatMap((line) => [
          line.curve[0],
          line.curve[line.curve.length >> 1],
          line.curve.at(-1),
        ]),
      );
      points.push(
        ...[...this.description.springs, ...this.description.guides].flatMap(({ ends }) =>
          ends.map((end) => shapes.carried(end.body, end.point, shape.poses)),
        ),
      );
      points.push(...this.bodies.flatMap((_, k) => shapes.body(k, shape.poses)));
    }
    const poses = shapes.drawn;
    this.description.stops.forEach((stop, k) => {
      const { point, into } = shapes.wall(k, this.actions.wall(k), poses);
      const half = times(shapes.wallLength(k) / 2, turned(into, [0, 1]));
      points.push(
        plus(point, half),
        minus(point, half),
        plus(point, times(0.08 * shapes.size, into)),
      );
    });
    const sides = [0, 1].map((axis) => {
      const along = points.map((point) => point[axis]).filter(Number.isFinite);
      return [Math.min(...along), Math.max(...along)];
    });
    const outside =
      this.bounds === null ||
      sides.some(([low, high], axis) => {
        const [a, b] = this.bounds[axis];
        const room = 0.25 * (b - a);
        return low < a - room || high > b + room || high - low < 0.5 * (b - a);
      });
    if (outside) {
      this.bounds = sides;
      this.resize(shapes);
    }
  }

  resize(shapes) {
    const width = this.svg.clientWidth;
    const [[left, right], [bottom, top]] = this.bounds;
    const aspect = (top - bottom) / (right - left);
    const height = Math.round(
      Math.max(
        220,
        Math.min(
          0.62 * width + 60,
          440,
          HEIGHT_MAX * window.innerHeight,
          aspect * (width - 2 * MARGIN) + 2 * MARGIN + FOOT,
        ),
      ),
    );
    this.svg.setAttribute("height", height);
    this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.pixels = Math.min(
      (width - 2 * MARGIN) / (right - left),
      (height - 2 * MARGIN - FOOT) / (top - bottom),
    );
    this.origin = [
      width / 2 - (this.pixels * (left + right)) / 2,
      (height - FOOT) / 2 + (this.pixels * (bottom + top)) / 2,
    ];
    this.drawFixed(shapes, width, height);
  }

  screen([x, y]) {
    return [this.origin[0] + this.pixels * x, this.origin[1] - this.pixels * y];
  }

  path(points) {
    return `M${points
      .map((point) =>
        this.screen(point)
          .map((x) => x.toFixed(2))
          .join(","),
      )
      .join("L")}`;
  }

  // Return the path of a flexure: its curve, or the edge of its profile.
  outline({ curve, edge }) {
    return edge ? `${this.path(edge)}Z` : this.path(curve);
  }

  // -- parts --

  drawFixed(shapes, width, height) {
    const rest = shapes.straight;
    rest.lines.forEach((line, k) => this.straight[k].setAttribute("d", this.outline(line)));
    const parts = [];
    for (const [k, flexure] of this.description.flexures.entries()) {
      flexure.ends.forEach((end, side) => {
        if (end.body === GROUND) {
          const { curve, edge } = rest.lines[k];
          const [near, next] = side === 0 ? curve : [curve.at(-1), curve.at(-2)];
          const chord = norm(minus(curve[0], curve.at(-1)));
          const corner = side === 0 ? 0 : curve.length;
          const width = edge ? norm(minus(edge.at(corner - 1), edge[corner])) : 0;
          const length = Math.max(Math.min(0.16 * shapes.size, 0.4 * chord), 1.3 * width);
          const into = times(1 / norm(minus(near, next)), minus(near, next));
          parts.push(this.hatched(near, into, length));
        }
      });
    }
    for (const joint of this.description.joints) {
      if (joint.ends.some((end) => end.body === GROUND)) {
        const point = pointOf(joint.ends[0].point, shapes.values);
        parts.push(this.hatched(point, [0, -1], 0.08 * shapes.size));
      }
    }
    for (const { ends } of [...this.description.springs, ...this.description.guides]) {
      const [start, end] = ends.map((one) => pointOf(one.point, shapes.values));
      const along = times(1 / norm(minus(end, start)), minus(end, start));
      [
        [start, times(-1, along)],
        [end, along],
      ].forEach(([point, into], side) => {
        if (ends[side].body === GROUND) {
          parts.push(this.hatched(point, into, 0.08 * shapes.size));
        }
      });
    }
    this.ground.setAttribute("d", parts.join(""));
    const rings = this.description.groundParts
      .flat()
      .map((ring) => `${this.path(ring.map((corner) => pointOf(corner, shapes.values)))}Z`);
    this.fixed.setAttribute("d", rings.join(""));
    this.drawScale(width, height);
  }

  drawScale(width, height) {
    const length = roundBelow((0.22 * width) / this.pixels);
    const [right, base] = [width - 16, height - 12];
    const left = right - length * this.pixels;
    this.scale.setAttribute("d", `M${left},${base - 4}v4H${right}v-4`);
    this.scaleText.setAttribute("x", (left + right) / 2);
    this.scaleText.setAttribute("y", base - 8);
    this.scaleText.textContent = quantityText(length, prefixed(length, "m"));
  }

  // Return the path of a line through a point, hatched on the side of the unit vector.
  hatched(point, into, length) {
    const along = times(length, turned([0, 1], into));
    const start = minus(point, times(0.5, along));
    const count = Math.max(HATCHES_MIN, Math.round((length * this.pixels) / HATCH_PITCH));
    const strokes = Array.from({ length: count }, (_, k) => {
      const z = plus(start, times((k + 0.7) / count, along));
      return this.path([z, plus(z, times(0.65 / count, minus(times(length, into), along)))]);
    });
    return this.path([start, plus(start, along)]) + strokes.join("");
  }

  // Draw a shape.  Impacts: those whose marks are visible, with their age as a share of FLASH_TIME.
  draw(shapes, shape, flashes = []) {
    this.last = [shapes, shape];
    const { description } = this;
    shape.lines.forEach((line, k) => {
      this.flexures[k].setAttribute("d", this.outline(line));
      this.links[k].setAttribute("d", line.corners.length ? this.path(line.corners) : "");
      const circles = line.corners.slice(1, -1).map((corner) => this.circle(corner, 3));
      this.pivots[k].setAttribute("d", circles.join(""));
    });
    description.bodies.forEach((body, k) => {
      const lines = [shapes.body(k, shape.poses), ...shapes.holes(k, shape.poses)];
      this.bodies[k].setAttribute("d", lines.map((line) => `${this.path(line)}Z`).join(""));
      const [x, y] = this.screen(shape.poses.get(body.name).centre);
      this.centres[k].setAttribute("d", `M${x - 5},${y}h10M${x},${y - 5}v10`);
    });
    const springs = description.springs.map(({ ends }) =>
      zigzag(ends.map((end) => shapes.carried(end.body, end.point, shape.poses)), shapes.size),
    );
    const slots = description.guides.map(({ ends }) =>
      slot(ends.map((end) => shapes.carried(end.body, end.point, shape.poses)), shapes.size),
    );
    this.springs.setAttribute("d", [...springs, ...slots].map((line) => this.path(line)).join(""));
    const pins = [
      ...description.joints.map((joint) => joint.ends[0]),
      ...description.guides.map((guide) => guide.point),
      ...description.flexures.flatMap((f) => f.ends.filter((_, side) => !f.guided[side])),
    ];
    const places = pins.map((end) => shapes.carried(end.body, end.point, shape.poses));
    this.pins.setAttribute("d", places.map((place) => this.circle(place, 4)).join(""));
    const probes = description.probes.map((p) => shapes.carried(p.body, p.point, shape.poses));
    this.probes.setAttribute("d", probes.map((place) => this.circle(place, 3.5)).join(""));
    this.drawStops(shapes, shape, flashes);
  }

  // Draw the outlines of a shape of the run before the last change; null: none.
  drawBefore(earlier) {
    const lines = earlier
      ? [
          ...earlier[1].lines.map((line) => this.outline(line)),
          ...this.bodies.map((_, k) => `${this.path(earlier[0].body(k, earlier[1].poses))}Z`),
        ]
      : [];
    this.before.forEach((node, k) => node.setAttribute("d", lines[k] ?? ""));
  }

  // Colour the flexures by shares of a largest stress; null: none is known.
  colour(shares) {
    this.flexures.forEach((node, k) => {
      const share = shares ? (100 * shares[k]).toFixed(0) : 0;
      node.style.setProperty("--stress", `${share}%`);
    });
  }

  circle(point, r) {
    const [x, y] = this.screen(point);
    return `M${(x - r).toFixed(2)},${y.toFixed(2)}a${r},${r} 0 1,0 ${2 * r},0a${r},${r} 0 1,0 ${-2 * r},0`;
  }

  drawStops(shapes, shape, flashes) {
    this.description.stops.forEach((stop, k) => {
      const { point, into } = shapes.wall(k, this.actions.wall(k), shape.poses);
      this.walls[k].setAttribute("d", this.hatched(point, into, shapes.wallLength(k)));
      const [x, y] = this.screen(shapes.hitPoint(k, shape.poses));
      filled(this.hits[k], { cx: x, cy: y }, []);
      const flash = flashes.find((mark) => mark.stop === k);
      const [wx, wy] = this.screen(point);
      const r = flash ? 6 + 22 * flash.strength * (0.4 + 0.6 * flash.age) : 0;
      filled(this.flashes[k], { cx: wx, cy: wy, r, opacity: flash ? 1 - flash.age : 0 }, []);
      const [behind, beyond] = HANDLE_OFFSET.map((offset) => offset / this.pixels);
      const beside = turned(into, [behind, shapes.wallLength(k) / 2 + beyond]);
      const along = times(1 / stop.ratio, into);
      this.place(this.wallHandles[k], plus(point, beside), along, stop.quantity);
    });
    if (this.bodyHandle) {
      this.placeBodyHandle(shapes, shape);
    }
  }

  // Place the handle of the released body at its released point or, for a release by an angle, at the
  // corner that is farthest from its centre.
  placeBodyHandle(shapes, shape) {
    const { body, point, direction, quantity, start } = this.description.release;
    if (start !== "angle") {
      const held = shapes.carried(body, point, shape.poses);
      this.place(this.bodyHandle, held, unitVector(direction), quantity);
      return;
    }
    const { centre } = shape.poses.get(body);
    const index = this.description.bodies.findIndex(({ name }) => name === body);
    const arms = shapes.body(index, shape.poses).map((corner) => minus(corner, centre));
    const arm = arms.reduce((a, b) => (norm(b) > 1.001 * norm(a) ? b : a));
    const along = times(1 / norm(arm) ** 2, turned([0, 1], arm)); // Radians for a metre.
    this.place(this.bodyHandle, plus(centre, arm), along, quantity);
  }

  place(handle, point, along, name) {
    const [x, y] = this.screen(point);
    const angle = (-Math.atan2(along[1], along[0]) * 180) / Math.PI;
    const value = this.actions.value(name);
    const quantity = this.actions.quantity(name);
    handle.along = along;
    handle.setAttribute(
      "transform",
      `translate(${x.toFixed(2)},${y.toFixed(2)}) rotate(${angle.toFixed(2)})`,
    );
    // Numbers in the shown unit, without exponents, which are not valid here.
    const number = (x) => (x * quantity.factor).toFixed(6);
    handle.setAttribute("aria-valuemin", number(quantity.slider.low));
    handle.setAttribute("aria-valuemax", number(quantity.slider.high));
    handle.setAttribute("aria-valuenow", number(value));
    handle.setAttribute("aria-valuetext", quantityText(value, quantity));
  }
}

// Round a number to a step that is a power of ten, at most the given one.
function rounded(x, step) {
  const power = 10 ** Math.floor(Math.log10(step));
  return Number((Math.round(x / power) * power).toPrecision(12));
}
