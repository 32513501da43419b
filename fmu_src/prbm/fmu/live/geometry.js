// Points and curves of a drawing, as pairs [x, y] in metres.

const GROUND = "ground";
const CURVE_POINTS = 40; // Points of the drawn curve of a flexure.
const SPLINE_POINTS = 8; // Points of the drawn curve between two nodes of a beam.
const CURVED_CORNERS_MAX = 11; // More corners are joined by straight lines, not by a curve.
const COINCIDENT_RTOL = 1e-9; // A shorter step between points, over the length of the line, is none.
const SPRING_WIDTH = 0.05; // Of the size of the mechanism: width of the zigzag of a spring.
const SLOT_WIDTH = 0.04; // Of the size of the mechanism: width of the slot that shows a guide.
const COILS = 6; // Corners of this zigzag on each side.
const COILED = 0.7; // Share of the length of a spring that is coiled.
const BODY_THICKNESS_MIN = 0.04; // Of the size of the mechanism.

const plus = ([a, b], [c, d]) => [a + c, b + d];
const minus = ([a, b], [c, d]) => [a - c, b - d];
const times = (x, [a, b]) => [x * a, x * b];
const turned = ([a, b], [c, d]) => [a * c - b * d, a * d + b * c]; // Product of complex numbers.
const norm = ([a, b]) => Math.hypot(a, b);
const cross = ([a, b], [c, d]) => a * d - b * c;

// Return the unit vector at an angle in degrees, exact along the axes.
function unitVector(degrees) {
  const quarter = degrees / 90;
  if (Number.isInteger(quarter)) {
    return [
      [1, 0],
      [0, 1],
      [-1, 0],
      [0, -1],
    ][((quarter % 4) + 4) % 4];
  }
  const angle = (degrees * Math.PI) / 180;
  return [Math.cos(angle), Math.sin(angle)];
}

// Return the value of an expression: a number, or a constant and factors of parameters.
function evaluated(expression, values) {
  if (typeof expression === "number") {
    return expression;
  }
  const [constant, terms] = expression;
  return Object.entries(terms).reduce(
    (sum, [name, factor]) => sum + factor * values.get(name),
    constant,
  );
}

// Return the line of a coil spring between two points.
function zigzag([start, end], size) {
  const along = minus(end, start);
  const across = times((0.5 * SPRING_WIDTH * size) / (norm(along) || 1), turned([0, 1], along));
  const coils = Array.from({ length: 2 * COILS + 2 }, (_, k) => {
    const share = 0.5 + COILED * (k / (2 * COILS + 1) - 0.5);
    const side = k === 0 || k === 2 * COILS + 1 ? 0 : k % 2 === 0 ? 1 : -1;
    return plus(plus(start, times(share, along)), times(side, across));
  });
  return [start, ...coils, end];
}

// Return the outline of the slot between two points that shows a guide.
function slot([start, end], size) {
  const along = minus(end, start);
  const across = times((0.5 * SLOT_WIDTH * size) / (norm(along) || 1), turned([0, 1], along));
  const corners = [plus(start, across), plus(end, across), minus(end, across), minus(start, across)];
  return [...corners, corners[0]];
}

const pointOf = (point, values) => point.map((x) => evaluated(x, values));

// Return Hermite's cubic between the ends of a chain of links, tangential to the links at guided
// ends and without curvature at pinned ends.
function chainCurve(z, [startGuided, endGuided]) {
  const steps = z.slice(1).map((point, k) => minus(point, z[k]));
  const length = steps.reduce((sum, step) => sum + norm(step), 0);
  const long = steps.filter((step) => norm(step) > COINCIDENT_RTOL * length);
  const first = z[0];
  const last = z[z.length - 1];
  const chord = minus(last, first);
  const along = (step) => times(length / norm(step), step);
  let [a, b] = [along(long[0]), along(long[long.length - 1])];
  if (!startGuided && !endGuided) {
    a = b = chord;
  } else if (!startGuided) {
    a = times(0.5, minus(times(3, chord), b));
  } else if (!endGuided) {
    b = times(0.5, minus(times(3, chord), a));
  }
  return Array.from({ length: CURVE_POINTS }, (_, k) => {
    const s = k / (CURVE_POINTS - 1);
    const r = 1 - s;
    const ends = plus(times((1 + 2 * s) * r * r, first), times((3 - 2 * s) * s * s, last));
    return plus(ends, times(r * s, minus(times(r, a), times(s, b))));
  });
}

// Return points without those that coincide with the point before: the nodes in the thick parts of a
// notch that fills its flexure do.
function distinct(points) {
  const steps = points.slice(1).map((point, k) => norm(minus(point, points[k])));
  const least = COINCIDENT_RTOL * steps.reduce((sum, step) => sum + step, 0);
  return points.filter((_, k) => k === 0 || steps[k - 1] > least);
}

// Return a smooth curve through points (Catmull and Rom, centripetal).
function splineCurve(points) {
  const z = distinct(points);
  const parts = z.slice(1).map((_, k) => splinePart(z, k, SPLINE_POINTS));
  return [z[0], ...parts.flat()];
}

function splinePart(z, k, count) {
  const b = z[k];
  const c = z[k + 1];
  const a = k > 0 ? z[k - 1] : minus(times(2, b), c);
  const d = k + 2 < z.length ? z[k + 2] : minus(times(2, c), b);
  const [p, q, r] = [minus(b, a), minus(c, b), minus(d, c)].map((v) => Math.sqrt(norm(v)));
  const slope = (u, v, w, before, after) => {
    const first = times(1 / before, minus(v, u));
    const second = times(1 / after, minus(w, v));
    return plus(times(after / (before + after), first), times(before / (before + after), second));
  };
  const start = times(q, slope(a, b, c, p, q));
  const end = times(q, slope(b, c, d, q, r));
  return Array.from({ length: count }, (_, i) => {
    const s = (i + 1) / count;
    const t = 1 - s;
    const ends = plus(times((1 + 2 * s) * t * t, b), times((3 - 2 * s) * s * s, c));
    return plus(ends, times(t * s, minus(times(t, start), times(s, end))));
  });
}

// Return the thickness of a flexure at the arc length s from its start.  It has the dimensions of a
// profile and the length L.
function thicknessAt(profile, s, L) {
  const { thickness, end_thickness: outside, notch_radius: along } = profile;
  if (along === undefined) {
    return thickness + ((outside - thickness) * s) / L; // A taper.
  }
  const across = profile.notch_depth;
  const edge = Math.acos(Math.max(1 - (outside - thickness) / (2 * across), 0));
  const apart = Math.max(Math.abs(s - L / 2) - (profile.waist_length ?? 0) / 2, 0);
  if (apart > along * Math.sin(edge)) {
    return outside;
  }
  return thickness + 4 * across * Math.sin(Math.asin(apart / along) / 2) ** 2;
}

// Return the edge of a flexure whose thickness varies, from the curve of its centre line.
function profileEdge(curve, profile, L) {
  const steps = curve.slice(1).map((point, k) => minus(point, curve[k]));
  const lengths = steps.map(norm);
  const total = lengths.reduce((sum, length) => sum + length, 0);
  let s = 0;
  const levers = curve.map((_, k) => {
    const along = plus(steps[Math.max(k - 1, 0)], steps[Math.min(k, steps.length - 1)]);
    const half = thicknessAt(profile, (s / total) * L, L) / 2;
    s += lengths[k] ?? 0;
    return times(half / norm(along), turned([0, 1], along));
  });
  const left = curve.map((point, k) => plus(point, levers[k]));
  return [...curve.map((point, k) => minus(point, levers[k])), ...left.reverse()];
}

// Return the corners of the convex hull of points, counter-clockwise.
function hull(points) {
  const sorted = [...points].sort((u, v) => u[0] - v[0] || u[1] - v[1]);
  const half = (list) => {
    const chain = [];
    for (const point of list) {
      while (
        chain.length > 1 &&
        cross(minus(chain.at(-1), chain.at(-2)), minus(point, chain.at(-1))) <= 0
      ) {
        chain.pop();
      }
      chain.push(point);
    }
    return chain.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

// Return whether the origin lies inside a hull.
function surrounds(corners, distance) {
  return (
    corners.length > 2 &&
    corners.every((corner, k) => {
      const side = minus(corners[(k + 1) % corners.length], corner);
      return cross(side, times(-1, corner)) > distance * norm(side);
    })
  );
}

// Return the corners of a body about its centre of mass: the hull of its points if that contains
// the centre, otherwise the smallest box about the centre that contains them.
function bodyOutline(reach, size) {
  const around = hull(reach);
  if (surrounds(around, 1e-9 * size)) {
    return around;
  }
  const least = (BODY_THICKNESS_MIN * size) / 2;
  const directions = [[1, 0], ...reach.filter((z) => norm(z) > 1e-9 * size)];
  let best = null;
  for (const [k, direction] of directions.entries()) {
    const along = times(1 / norm(direction), direction);
    const back = [along[0], -along[1]];
    const local = reach.map((z) => turned(z, back));
    const x = Math.max(least, ...local.map((z) => Math.abs(z[0])));
    const y = Math.max(least, ...local.map((z) => Math.abs(z[1])));
    if (best === null || x * y < (k && best.upright ? 0.4 : 1) * best.area) {
      best = { area: x * y, along, x, y, upright: k === 0 };
    }
  }
  const { along, x, y } = best;
  return [
    [-x, -y],
    [x, -y],
    [x, y],
    [-x, y],
  ].map((corner) => turned(corner, along));
}

// The drawn parts of a mechanism with given parameters, in any of its shapes.
class Shapes {
  // Parameters: the description of the page, the values of all parameters by name, and a
  // simulation with these values.
  constructor(description, values, simulation) {
    this.description = description;
    this.values = values;
    this.simulation = simulation;
    this.drawn = new Map([[GROUND, { centre: [0, 0], arm: [1, 0] }]]);
    for (const body of description.bodies) {
      this.drawn.set(body.name, { centre: pointOf(body.centre, values), arm: [1, 0] });
    }
    this.hits = description.stops.map((stop) => this.hit(stop));
    this.size = this.extent();
    this.outlines = description.bodies.map((body) => this.outline(body));
  }

  hit(stop) {
    const offset = evaluated(stop.offset, this.values);
    const across = turned([0, 1], unitVector(stop.direction));
    return plus(pointOf(stop.point, this.values), times(offset, across));
  }

  extent() {
    const { bodies, flexures } = this.description;
    const points = [
      ...bodies.flatMap((body) => [body.centre, ...body.points, ...body.outline]),
      ...flexures.flatMap((flexure) => flexure.ends.map((end) => end.point)),
    ].map((point) => pointOf(point, this.values));
    const spans = [0, 1].map((axis) => {
      const along = points.map((point) => point[axis]);
      return Math.max(...along) - Math.min(...along);
    });
    return Math.max(...spans);
  }

  // Return the corners of a body: those of its outline, or of a shape around its points.
  outline(body) {
    const { centre } = this.drawn.get(body.name);
    if (body.outline.length) {
      return body.outline.map((corner) => minus(pointOf(corner, this.values), centre));
    }
    const points = body.points.map((point) => pointOf(point, this.values));
    this.description.stops.forEach((stop, k) => {
      if (stop.body === body.name) {
        points.push(this.hits[k]);
      }
    });
    return bodyOutline(
      points.map((point) => minus(point, centre)),
      this.size,
    );
  }

  // The shape as drawn: each flexure of links is a line between its ends.  At coordinates of zero a
  // beam has its drawn shape, but may be moved with a body that links carry.
  get straight() {
    const { lines } = this.shape(this.simulation.points(new Float64Array(this.simulation.size)));
    const drawn = this.description.flexures.map(({ beam, ends }, k) => {
      const [start, end] = ends.map((place) => pointOf(place.point, this.values));
      if (!beam) {
        return { curve: [start, end], corners: [] };
      }
      const moved = minus(start, lines[k].curve[0]);
      return this.withEdge(k, {
        curve: lines[k].curve.map((point) => plus(point, moved)),
        corners: [],
      });
    });
    return { poses: this.drawn, lines: drawn };
  }

  // Return the shape at coordinates: the poses of the bodies and the lines of the flexures.
  at(q) {
    return this.shape(this.simulation.points(q));
  }

  // Return the shape for the points of a drawing, which the kernel computes.  through: whether the
  // curve of a flexure goes through its pivots, to show modes that bend it between its ends.
  shape(numbers, through = false) {
    let next = 0;
    const take = () => [numbers[next++], numbers[next++]];
    const lines = this.description.flexures.map((flexure) =>
      Array.from({ length: flexure.corners }, take),
    );
    next = 2 * (this.simulation.pointCount - 2 * this.description.bodies.length);
    const poses = new Map([[GROUND, this.drawn.get(GROUND)]]);
    for (const body of this.description.bodies) {
      poses.set(body.name, { centre: take(), arm: take() });
    }
    return { poses, lines: lines.map((line, k) => this.line(k, line, poses, through)) };
  }

  line(k, corners, poses, through) {
    const flexure = this.description.flexures[k];
    if (!flexure.beam && flexure.corners > CURVED_CORNERS_MAX) {
      return { curve: corners, corners };
    }
    if (!flexure.beam) {
      return {
        curve: through ? splineCurve(corners) : chainCurve(corners, flexure.guided),
        corners,
      };
    }
    const [start, end] = flexure.ends.map((place) => this.carried(place.body, place.point, poses));
    return this.withEdge(k, { curve: splineCurve([start, ...corners, end]), corners: [] });
  }

  // Return a line with the edge of its flexure, if the thickness of the flexure varies.
  withEdge(k, line) {
    const { profile, ends } = this.description.flexures[k];
    if (!profile) {
      return line;
    }
    const given = Object.entries(profile).map(([name, x]) => [name, evaluated(x, this.values)]);
    const [start, end] = ends.map((place) => pointOf(place.point, this.values));
    const edge = profileEdge(line.curve, Object.fromEntries(given), norm(minus(end, start)));
    return { ...line, edge };
  }

  // Return the position of a drawn point of a body; point is an expression.
  carried(body, point, poses) {
    return this.moved(body, pointOf(point, this.values), poses);
  }

  moved(body, drawn, poses) {
    const pose = poses.get(body);
    return plus(pose.centre, turned(minus(drawn, this.drawn.get(body).centre), pose.arm));
  }

  body(k, poses) {
    const pose = poses.get(this.description.bodies[k].name);
    return this.outlines[k].map((corner) => plus(pose.centre, turned(corner, pose.arm)));
  }

  // Return the holes of a body, each as a list of corners.
  holes(k, poses) {
    const { name, holes } = this.description.bodies[k];
    return holes.map((hole) => hole.map((corner) => this.carried(name, corner, poses)));
  }

  hitPoint(k, poses) {
    return this.moved(this.description.stops[k].body, this.hits[k], poses);
  }

  // Return the point of a wall that the body hits, and the direction into the wall.
  wall(k, position, poses) {
    const stop = this.description.stops[k];
    const into = unitVector(stop.direction);
    const point = this.moved(stop.on, plus(this.hits[k], times(position, into)), poses);
    return { point, into: turned(into, poses.get(stop.on).arm) };
  }

  wallLength(k) {
    const { on } = this.description.stops[k];
    if (on === GROUND) {
      return 0.36 * this.size;
    }
    const index = this.description.bodies.findIndex((body) => body.name === on);
    const reach = Math.max(...this.outlines[index].map(norm));
    return 0.36 * Math.min(this.size, 2 * reach);
  }
}
