// Numbers and elements of the page.  Texts of the mechanism are set as text, never as markup.

const SVG = "http://www.w3.org/2000/svg";
const SYMBOLS = { deg: "°", "deg/s": "°/s", um: "µm", us: "µs", 1: "" };

// Return an element of HTML with attributes and children, which are elements or texts.
function element(tag, attributes = {}, ...children) {
  return filled(document.createElement(tag), attributes, children);
}

function drawn(tag, attributes = {}, ...children) {
  return filled(document.createElementNS(SVG, tag), attributes, children);
}

function filled(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value !== null && value !== undefined) {
      node.setAttribute(name, value);
    }
  }
  node.append(...children);
  return node;
}

const byId = (id) => document.getElementById(id);

// Return a unit as it is shown: m/s2 as m/s², N.m as N·m.
function unitText(unit) {
  if (unit in SYMBOLS) {
    return SYMBOLS[unit];
  }
  return unit.replaceAll(".", "·").replaceAll("2", "²").replaceAll("3", "³");
}

// Return a number with a few significant digits.
function digits(x, count = 4) {
  if (!Number.isFinite(x)) {
    return String(x);
  }
  const text = Number(x.toPrecision(count));
  const size = Math.abs(text);
  if (size !== 0 && (size < 1e-4 || size >= 1e7)) {
    return text.toExponential();
  }
  return String(text);
}

// Return a quantity with its unit.  kind has the unit that is shown, and its factor over SI.
function quantityText(x, kind, count = 4) {
  const unit = unitText(kind.shown);
  const gap = unit === "" || unit === "°" ? "" : "\u202f";
  return `${digits(x * kind.factor, count).replace("-", "\u2212")}${gap}${unit}`;
}

// Return the prefix of SI that suits a largest value in SI units.
function prefixed(largest, unit) {
  const steps = [
    [1, ""],
    [1e3, "m"],
    [1e6, "µ"],
    [1e9, "n"],
    [1e12, "p"],
  ];
  const large = [
    [1e-9, "G"],
    [1e-6, "M"],
    [1e-3, "k"],
  ];
  if (largest === 0) {
    return { factor: 1, shown: unit };
  }
  for (const [factor, prefix] of [...large, ...steps]) {
    if (largest * factor >= 1) {
      return { factor, shown: prefix + unit };
    }
  }
  return { factor: 1, shown: unit };
}

// Return a time with a suitable prefix.
function timeText(time, longest, count = 4) {
  return quantityText(time, prefixed(longest, "s"), count);
}

// Return round numbers between two bounds, about count of them.
function ticks(low, high, count) {
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((k) => k * power).find((k) => k >= rough * 0.999);
  const first = Math.ceil(low / step - 1e-9);
  const last = Math.floor(high / step + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, k) =>
    Number(((first + k) * step).toPrecision(12)),
  );
}

// Return the largest number of the form 1, 2 or 5 times a power of ten below a limit.
function roundBelow(limit) {
  const power = 10 ** Math.floor(Math.log10(limit));
  return Number(([5, 2, 1].find((k) => k * power <= limit) * power).toPrecision(1));
}

// Return a name without underscores.
const words = (name) => name.replaceAll("_", " ");
