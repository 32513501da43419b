// Fields and sliders of all parameters and inputs.

const SLIDER_STEPS = 1000;
const BOUND_SHOWN_MAX = 100; // Bounds that are this often as large as the slider are not shown.
const FIRST_GROUPS = 2; // Groups that are open at first, and that of the file's own parameters.
const OWN = "[[geometry]]"; // Parameters that the mechanism file defines.
const LAST = ["damping", "friction", "gravity", "base", "solver"];

class Controls {
  // Parameters: the parent element, the description of the page, and the functions
  // change(name, value, ended) and reject(message, name) for a text that is not a number.
  constructor(parent, description, { change, reject }) {
    this.change = change;
    this.reject = reject;
    this.rows = new Map();
    const groups = new Map();
    for (const quantity of description.quantities) {
      const key = quantity.own ? OWN : quantity.kind === "input" ? "inputs" : quantity.group;
      groups.set(key, [...(groups.get(key) ?? []), quantity]);
    }
    const names = [...groups.keys()].sort((a, b) => rank(a, description) - rank(b, description));
    names.forEach((name, k) => {
      const full = name === "inputs" || name === OWN;
      const rows = groups.get(name).map((quantity) => this.row(quantity, full));
      const summary = element("summary", {}, heading(name), element("span", { class: "count" }));
      const details = element("details", {}, summary, ...rows);
      details.open = k < FIRST_GROUPS + Number(names[0] === OWN);
      parent.append(details);
    });
  }

  row(quantity, full) {
    const id = `q-${quantity.slot}`;
    const label = element(
      "label",
      { for: id, title: quantity.name },
      labelled(full ? quantity.name : quantity.label),
    );
    const number = element("input", {
      id,
      type: "text",
      inputmode: "decimal",
      autocomplete: "off",
      spellcheck: "false",
      "aria-describedby": `${id}-note`,
      "data-name": quantity.name,
    });
    const unit = element("span", { class: "unit" }, unitText(quantity.shown));
    const reset = element(
      "button",
      {
        type: "button",
        class: "undo",
        title: `Reset ${quantity.name}`,
        "aria-label": `Reset ${quantity.name}`,
      },
      "\u21ba",
    );
    const slider = element("input", {
      type: "range",
      min: 0,
      max: SLIDER_STEPS,
      step: 1,
      "aria-label": quantity.name,
    });
    const note = element(
      "p",
      { id: `${id}-note`, class: "note" },
      `${quantity.description}${bounds(quantity)}`,
    );
    const node = element(
      "div",
      { class: "row" },
      label,
      element("span", { class: "entry" }, number, unit, reset),
      slider,
      note,
    );
    const row = { quantity, node, number, slider, reset };
    this.rows.set(quantity.name, row);
    number.addEventListener("change", () => this.entered(quantity, number.value));
    slider.addEventListener("input", () =>
      this.change(quantity.name, fromSlider(quantity, Number(slider.value)), false),
    );
    slider.addEventListener("change", () =>
      this.change(quantity.name, fromSlider(quantity, Number(slider.value)), true),
    );
    reset.addEventListener("click", () => this.change(quantity.name, quantity.start, true));
    return node;
  }

  // Take the text of a field.
  entered(quantity, text) {
    const x = parsed(withoutUnit(text, quantity));
    if (Number.isNaN(x)) {
      const unit = unitText(quantity.shown);
      const given = text.trim() === "" ? "an empty field" : `\u201c${text.trim()}\u201d`;
      const needed = unit ? `a number in ${unit}` : "a number without a unit";
      this.reject(`${quantity.name}: ${given} is not ${needed}.`, quantity.name);
    } else {
      this.change(quantity.name, x / quantity.factor, true);
    }
  }

  // Show the value of a quantity [SI].
  show(name, value) {
    const { quantity, node, number, slider } = this.rows.get(name);
    if (Number.isFinite(value)) {
      const text = shownText(quantity, value);
      if (Number(number.value) !== Number(text) || number.value === "") {
        number.value = text;
      }
      slider.value = toSlider(quantity, value);
      slider.setAttribute("aria-valuetext", quantityText(value, quantity));
    }
    node.classList.toggle("changed", !Object.is(value, quantity.start));
    const details = node.parentElement;
    const changed = details.querySelectorAll(".row.changed").length;
    details.querySelector(".count").textContent = changed ? `${changed} changed` : "";
  }

  // Mark the quantity that a message is about; null: none.
  mark(name) {
    for (const [own, { number, node }] of this.rows) {
      const wrong = own === name;
      number.toggleAttribute("aria-invalid", wrong);
      if (wrong) {
        number.setAttribute("aria-invalid", "true");
        number.setAttribute("aria-errormessage", "problem");
        node.parentElement.open = true;
        if (document.activeElement === number) {
          number.scrollIntoView({ block: "nearest" }); // The message has made the head higher.
        }
      }
    }
  }
}

// The order of a group: stops and the release, bodies and flexures, inputs, then the rest.
function rank(name, description) {
  if (name === OWN) {
    return -1;
  }
  if (description.stops.some((stop) => stop.name === name)) {
    return 0;
  }
  if (name === "release") {
    return 1;
  }
  if (name === "inputs") {
    return 3;
  }
  const last = LAST.indexOf(name);
  return last < 0 ? 2 : 4 + last;
}

// Return a name as a label: words, unless it is a symbol such as K_theta.
function labelled(name) {
  return /^[A-Z]_/.test(name) ? name : words(name);
}

function heading(name) {
  if (name === OWN) {
    return "Parameters of the mechanism file";
  }
  const text = words(name);
  return text.charAt(0).toUpperCase() + text.slice(1);
}

// Return the text of a field without the unit of its quantity.
function withoutUnit(text, { shown }) {
  const clean = text.trim();
  const units = [shown, unitText(shown)].filter((unit) => unit !== "" && unit !== "1");
  const unit = units.find((name) => clean.endsWith(name));
  return unit ? clean.slice(0, -unit.length) : clean;
}

// Return a number from a text; NaN if it is none.
function parsed(text) {
  const clean = text.trim().replace(",", ".").replace("\u2212", "-");
  return clean === "" ? NaN : Number(clean);
}

function shownText(quantity, value) {
  return String(Number((value * quantity.factor).toPrecision(7)));
}

// Return the bounds of a quantity as text, without those that are far from usual values.
function bounds({ minimum, maximum, factor, shown, slider }) {
  const unit = unitText(shown);
  const text = (x) => `${digits(x * factor)}${unit ? `\u202f${unit}` : ""}`;
  const usual = BOUND_SHOWN_MAX * Math.max(Math.abs(slider.low), Math.abs(slider.high));
  const small =
    minimum !== null &&
    Math.abs(minimum) <= usual &&
    (minimum === 0 || minimum > usual * 1e-6 || minimum < 0);
  const large = maximum !== null && Math.abs(maximum) <= usual;
  if (small && large) {
    return ` (${text(minimum)} to ${text(maximum)})`;
  }
  return small ? ` (at least ${text(minimum)})` : large ? ` (at most ${text(maximum)})` : "";
}

function toSlider({ slider }, value) {
  const { low, high, logarithmic } = slider;
  const share = logarithmic
    ? Math.log(Math.max(value, 1e-300) / low) / Math.log(high / low)
    : (value - low) / (high - low);
  return Math.round(SLIDER_STEPS * Math.min(1, Math.max(0, share)));
}

function fromSlider({ slider, factor }, position) {
  const { low, high, logarithmic } = slider;
  const share = position / SLIDER_STEPS;
  const value = logarithmic ? low * (high / low) ** share : low + share * (high - low);
  const fine = logarithmic
    ? Number(value.toPrecision(4))
    : rounded(value, (high - low) / SLIDER_STEPS);
  return Number((Math.round(fine * factor * 1e9) / 1e9 / factor).toPrecision(12));
}
