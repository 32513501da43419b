// The modes about the equilibrium under gravity: a list of frequencies, and a moving shape.

const MODES_MAX = 8; // Modes in the list.
const MODE_AMPLITUDE = 0.1; // Largest displacement, as a share of the size of the mechanism.
const CLEARANCE_MIN = 0.1; // Of this amplitude: a mode with less room between walls passes them.
const SMALL_ANGLE = 1e-4; // rad; amplitude at which a mode is linear.
const MODE_PERIOD = 1.6; // Seconds of the film of one period.
const DIRECTION_RTOL = 0.3; // Smaller shares of the displacement of a body do not say how it moves.
const MOVING_RTOL = 0.05; // Parts with a smaller share of the largest displacement are not named.

class ModeView {
  // Parameters: the parent element, the description of the page, and the functions draw(shape),
  // and wall(k), the position of a wall [m].
  constructor(parent, description, draw, wall) {
    this.wall = wall;
    this.parent = parent;
    this.description = description;
    this.draw = draw;
    this.active = false;
    this.chosen = 0;
  }

  // Compute the modes of a mechanism, and show one of them.
  open(shapes) {
    this.shapes = shapes;
    this.active = true;
    this.parent.hidden = false;
    try {
      this.found = shapes.simulation.modes();
    } catch (error) {
      if (!(error instanceof KernelError)) {
        throw error;
      }
      this.parent.replaceChildren(element("p", { class: "hint" }, error.message));
      this.found = null;
      return;
    }
    this.list();
    this.choose(Math.min(this.chosen, this.found.modes.length - 1));
    this.frame(performance.now());
  }

  close() {
    this.active = false;
    this.parent.hidden = true;
  }

  list() {
    const shown = this.found.modes.slice(0, MODES_MAX);
    this.buttons = shown.map(({ frequency }, k) => {
      const text =
        frequency < 0
          ? "unstable"
          : quantityText(frequency, prefixed(Math.max(frequency, 1), "Hz"), 4);
      const button = element(
        "button",
        { type: "button", "aria-pressed": "false" },
        element("b", {}, `${k + 1}`),
        ` ${text}`,
      );
      button.addEventListener("click", () => this.choose(k));
      return button;
    });
    this.text = element("p", { class: "hint", "aria-live": "polite" });
    const group = element(
      "div",
      { class: "mode-list", role: "group", "aria-label": "Modes" },
      ...this.buttons,
    );
    this.parent.replaceChildren(group, this.text);
  }

  choose(k) {
    this.chosen = k;
    this.buttons.forEach((button, i) => button.setAttribute("aria-pressed", String(i === k)));
    this.setSlopes(this.found.modes[k].shape);
    const moves = this.parts().sort((a, b) => b[1] - a[1]);
    this.scale = (MODE_AMPLITUDE * this.shapes.size) / moves[0][1];
    const free = this.clearance();
    const crossing = free < CLEARANCE_MIN * this.scale;
    byId("live").classList.toggle("crossing", crossing);
    if (!crossing) {
      this.scale = Math.min(this.scale, free);
    }
    const shares = moves
      .filter(([, size]) => size > MOVING_RTOL * moves[0][1])
      .map(([name, size, how]) => {
        const share = `${words(name)} ${digits((100 * size) / moves[0][1], 2)}\u202f%`;
        return how ? `${share} (${how})` : share;
      });
    const resting = moves
      .filter(([, size]) => size <= MOVING_RTOL * moves[0][1])
      .map(([name]) => words(name));
    this.text.textContent =
      `Mode ${k + 1} moves: ${shares.join(", ")}` +
      (resting.length ? `. Hardly moves: ${resting.join(", ")}.` : ".") +
      " Percentages are of the largest displacement." +
      " Undamped, about the rest position under gravity, without stops." +
      (crossing ? " The motion that is drawn passes walls, which are pale." : "");
    this.paint(1);
  }

  // Compute the points of the drawing at rest, and their rates of change with the amplitude of a
  // mode.  Positions are linear in the arms, so that any amplitude keeps the parts connected.
  setSlopes(shape) {
    const h = SMALL_ANGLE / Math.max(...shape.map(Math.abs));
    const at = (amplitude) => {
      const q = this.found.q.map((x, j) => x + amplitude * shape[j]);
      return this.shapes.simulation.points(q).slice();
    };
    const [before, after] = [at(-h), at(h)];
    this.rest = at(0);
    this.slopes = this.rest.map((_, i) => (after[i] - before[i]) / (2 * h));
  }

  moved(amplitude) {
    return this.shapes.shape(
      this.rest.map((x, i) => x + amplitude * this.slopes[i]),
      true,
    );
  }

  // Return the amplitude of the mode at which a hit point reaches its wall, from the rest position.
  clearance() {
    const small = (SMALL_ANGLE * this.shapes.size) / Math.max(...this.slopes.map(Math.abs));
    const [rest, moved] = [this.moved(0), this.moved(small)];
    const gap = (k, { poses }) => {
      const { point, into } = this.shapes.wall(k, this.wall(k), poses);
      const [x, y] = minus(point, this.shapes.hitPoint(k, poses));
      return x * into[0] + y * into[1];
    };
    const free = this.description.stops.map((_, k) => {
      const rate = Math.abs(gap(k, moved) - gap(k, rest)) / small;
      return gap(k, rest) / Math.max(rate, 1e-300);
    });
    return Math.min(...free, Infinity);
  }

  // Return the largest displacement of each body and flexure for a mode of amplitude 1, and how the
  // body moves.
  parts() {
    const small = (SMALL_ANGLE * this.shapes.size) / Math.max(...this.slopes.map(Math.abs));
    const [rest, moved] = [this.moved(0), this.moved(small)];
    const largest = (a, b) => Math.max(...a.map((z, i) => norm(minus(b[i], z)))) / small;
    const corners = (shape, k) => {
      const line = shape.lines[k];
      return line.corners.length ? line.corners : line.curve;
    };
    const bodies = this.description.bodies.map(({ name }, k) => {
      const [a, b] = [rest, moved].map((shape) => this.shapes.body(k, shape.poses));
      return [name, largest(a, b), this.direction(k, rest.poses.get(name), moved.poses.get(name))];
    });
    const lines = this.description.flexures.map(({ name }, k) => [
      name,
      largest(corners(rest, k), corners(moved, k)),
    ]);
    return [...bodies, ...lines];
  }

  // Return how a body moves between two poses: along x or y, or by a rotation.
  direction(k, from, to) {
    const [x, y] = minus(to.centre, from.centre).map(Math.abs);
    const reach = Math.max(...this.shapes.outlines[k].map(norm));
    const rotation = reach * norm(minus(to.arm, from.arm));
    const ways = Object.entries({ x, y, rotation });
    const largest = Math.max(x, y, rotation);
    return ways
      .filter(([, size]) => size > DIRECTION_RTOL * largest)
      .map(([way]) => way)
      .join(", ");
  }

  paint(share) {
    this.draw(this.moved(share * this.scale));
  }

  frame(time) {
    if (!this.active || !this.found) {
      return;
    }
    if (!reducedMotion.matches) {
      this.paint(Math.sin((2 * Math.PI * time) / 1000 / MODE_PERIOD));
      requestAnimationFrame((next) => this.frame(next));
    }
  }
}
