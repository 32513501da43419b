// The modes about the equilibrium under gravity: a list of frequencies, and a moving shape.

const MODES_MAX = 8; // Modes in the list.
const MODE_AMPLITUDE = 0.1; // Largest displacement, as a share of the size of the mechanism.
const MODE_PERIOD = 1.6; // Seconds of the film of one period.
const MOVING_MIN = 0.05; // Parts with a smaller share of the largest displacement are not named.

class ModeView {
  // Parameters: the parent element, the description of the page, and the function draw(shape).
  constructor(parent, description, draw) {
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
        frequency < 0 ? "unstable" : quantityText(frequency, prefixed(Math.max(frequency, 1), "Hz"), 4);
      const button = element("button", { type: "button", "aria-pressed": "false" }, element("b", {}, `${k + 1}`), ` ${text}`);
      button.addEventListener("click", () => this.choose(k));
      return button;
    });
    this.text = element("p", { class: "hint", "aria-live": "polite" });
    const group = element("div", { class: "mode-list", role: "group", "aria-label": "Modes" }, ...this.buttons);
    this.parent.replaceChildren(group, this.text);
  }

  choose(k) {
    this.chosen = k;
    this.buttons.forEach((button, i) => button.setAttribute("aria-pressed", String(i === k)));
    const { shape } = this.found.modes[k];
    const largest = Math.max(...this.parts(shape, 1e-6).map(([, size]) => size));
    this.scale = (1e-6 * MODE_AMPLITUDE * this.shapes.size) / largest;
    const moves = this.parts(shape, this.scale).sort((a, b) => b[1] - a[1]);
    const shares = moves
      .filter(([, size]) => size > MOVING_MIN * moves[0][1])
      .map(([name, size]) => `${words(name)} ${digits((100 * size) / moves[0][1], 2)}\u202f%`);
    const still = moves.filter(([, size]) => size <= MOVING_MIN * moves[0][1]).map(([name]) => words(name));
    this.text.textContent =
      `Mode ${k + 1} moves: ${shares.join(", ")}` +
      (still.length ? `. Hardly moves: ${still.join(", ")}.` : ".") +
      " Percentages are of the largest displacement.";
    this.paint(1);
  }

  // Return the largest displacement of each body and flexure for an amplitude of a mode.
  parts(shape, amplitude) {
    const at = (sign) => this.shapes.at(this.moved(shape, sign * amplitude));
    const [rest, moved] = [at(0), at(1)];
    const bodies = this.description.bodies.map(({ name }, k) => {
      const [a, b] = [rest, moved].map((s) => this.shapes.body(k, s.poses));
      return [name, Math.max(...a.map((z, i) => norm(minus(b[i], z))))];
    });
    const lines = this.description.flexures.map(({ name }, k) => {
      const [a, b] = [rest, moved].map((s) => s.lines[k].curve);
      return [name, Math.max(...a.map((z, i) => norm(minus(b[i], z))))];
    });
    return [...bodies, ...lines];
  }

  moved(shape, amplitude) {
    return this.found.q.map((x, j) => x + amplitude * shape[j]);
  }

  paint(share) {
    const { shape } = this.found.modes[this.chosen];
    this.draw(this.shapes.at(this.moved(shape, share * this.scale)));
  }

  frame(time) {
    if (!this.active || !this.found) {
      return;
    }
    if (!still.matches) {
      this.paint(Math.sin((2 * Math.PI * time) / 1000 / MODE_PERIOD));
      requestAnimationFrame((next) => this.frame(next));
    }
  }
}
