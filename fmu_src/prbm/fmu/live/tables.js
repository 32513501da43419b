// The summary of a run and the table of its impacts.

const COLUMNS = [
  ["#", null, (impact, k) => k + 1],
  ["Stop", null, (impact) => impact.name],
  ["Time", "s", (impact) => impact.time],
  ["Approach", "m/s", (impact) => impact.approach],
  ["Rebound", "m/s", (impact) => impact.rebound],
  ["Impulse", "N.s", (impact) => impact.impulse],
  ["Energy lost", "J", (impact) => impact.lost],
  ["Modal restitution", "1", (impact) => impact.modal],
];
const COMPLIANT_COLUMNS = [
  ["Peak force", "N", (impact) => impact.peakForce],
  ["Indentation", "m", (impact) => impact.indentation],
  ["Duration", "s", (impact) => impact.duration],
];
const ROWS_MAX = 200; // Rows of the table; the CSV file has all outputs.

// Return what the headline says about a run, as pairs of a term and a text.
function headline(description, run, column) {
  const { stops } = description;
  const stress = peakStress(description, run, column);
  if (stops.length === 0) {
    return [["Simulated", timeText(run.time, run.time)], ...stress];
  }
  const last = (output) => stops.map(({ name }) => run.last(column.get(`${name}.${output}`)));
  const count = last("impact_count").reduce((sum, n) => sum + n, 0); // Includes unfinished contacts.
  const latest = Math.max(...last("impact_time"));
  const [first] = run.impacts;
  const unfinished = count ? "in contact" : "none";
  const speed = { factor: 1, shown: "m/s" };
  const resting = stops.filter((stop) => run.last(column.get(`${stop.name}.contact`)) > 0.5);
  const state = resting.length
    ? `at rest on ${resting.map((stop) => words(stop.name)).join(", ")}`
    : "moving";
  return [
    ["Impacts", `${count}`],
    [
      "First impact",
      first
        ? `${quantityText(first.approach, speed, 4)} at ${timeText(first.time, first.time)}`
        : unfinished,
    ],
    ["Last impact", count ? timeText(latest, latest) : "none"],
    ["Lost in impacts", quantityText(run.lost, prefixed(run.lost, "J"), 3)],
    ["At the end", state],
    ...peakForce(description, run, column),
    ...stress,
  ];
}

// Return the entry of the headline about the largest contact force so far; empty without compliant
// stops.  The columns contain contacts that are not counted as impacts, and the contact at the end;
// the impacts contain those between two rows.
function peakForce({ stops }, run, column) {
  const peaks = stops
    .map(({ name }) => column.get(`${name}.peak_force`))
    .filter((output) => output !== undefined);
  if (peaks.length === 0) {
    return [];
  }
  const inRows = peaks.map((output) => range(run, output)[1]);
  const largest = run.impacts.reduce(
    (most, impact) => Math.max(most, impact.peakForce),
    Math.max(...inRows),
  );
  return [["Peak force", quantityText(largest, prefixed(largest, "N"), 4)]];
}

// Return the entry of the headline about the largest stress so far, and the safety factor that is
// the least of the flexures with a yield strength; empty without outputs of the stress.  The stress
// after a rigid impact depends on the flexure model, so that the entry ends before it.
function peakStress({ flexures, stops }, run, column) {
  const rigid = ({ stop }) => !column.has(`${stops[stop].name}.peak_force`);
  const impact = run.impacts.find(rigid);
  const row = impact ? Math.floor(impact.time / run.step) : run.count - 1;
  const title = impact ? "Peak stress before impact" : "Peak stress";
  const peaks = flexures
    .map((flexure) => ({ ...flexure, output: column.get(`${flexure.name}.peak_stress`) }))
    .filter(({ output }) => output !== undefined)
    .map((flexure) => ({ ...flexure, peak: run.at(row, flexure.output) }));
  if (peaks.length === 0) {
    return [];
  }
  const largest = Math.max(...peaks.map(({ peak }) => peak));
  if (largest < ROUND_OFF.Pa) {
    return [[title, stressText(0)]];
  }
  const safety = Math.min(...peaks.map((flexure) => (flexure.yield ?? Infinity) / flexure.peak));
  const factor = Number.isFinite(safety) ? `, safety factor ${digits(safety, 3)}` : "";
  return [[title, `${stressText(largest)}${factor}`]];
}

// Return the main results of a headline as one line, for the head of the parameters.
function brief(pairs) {
  const shown = new Map(pairs);
  return ["Impacts", "First impact", "At the end", "Simulated"]
    .filter((term) => shown.has(term))
    .map((term) => `${term}: ${shown.get(term)}`)
    .join(" \u00b7 ");
}

function showHeadline(parent, pairs) {
  parent.replaceChildren(
    ...pairs.map(([term, text]) =>
      element("div", {}, element("dt", {}, term), element("dd", {}, text)),
    ),
  );
}

// Move between rows with the arrow keys; the Enter key calls show().
function chooseRow(event, line, show) {
  const neighbours = { ArrowDown: line.nextElementSibling, ArrowUp: line.previousElementSibling };
  if (event.key in neighbours) {
    event.preventDefault();
    neighbours[event.key]?.focus();
  } else if (event.key === "Enter") {
    show();
  }
}

// Fill the table of impacts.  seek(time) is called for the time of a row.
function showImpacts(table, description, run, seek) {
  const several = description.stops.length > 1;
  const compliant = run.impacts.some((impact) => impact.peakForce > 0);
  const columns = [
    ...COLUMNS.filter(([title]) => several || title !== "Stop"),
    ...(compliant ? COMPLIANT_COLUMNS : []),
  ];
  const rows = run.impacts.slice(0, ROWS_MAX).map((impact) => ({
    ...impact,
    name: words(description.stops[impact.stop].name),
  }));
  const units = columns.map(([, unit, value]) => {
    const largest = Math.max(0, ...rows.map((row, k) => (unit ? Math.abs(value(row, k)) : 0)));
    return unit && unit !== "1" ? prefixed(largest, unit) : { factor: 1, shown: "" };
  });
  const titles = columns.map(([title], k) => {
    const unit = unitText(units[k].shown);
    const shown = unit ? [" ", element("span", { class: "title-unit" }, `[${unit}]`)] : [];
    return element("th", { scope: "col" }, title, ...shown);
  });
  const body = rows.map((row, i) => {
    const cells = columns.map(([, unit, value], k) => {
      const x = value(row, i);
      return element(
        "td",
        {},
        unit ? digits(x * units[k].factor, 5).replace("-", "\u2212") : String(x),
      );
    });
    const line = element("tr", { "data-time": row.time, tabindex: i === 0 ? 0 : -1 }, ...cells);
    const show = () => seek(row.time);
    line.addEventListener("click", show);
    line.addEventListener("keydown", (event) => chooseRow(event, line, show));
    return line;
  });
  const wide = (text) => element("tr", {}, element("td", { colspan: columns.length }, text));
  if (run.impactCount > rows.length) {
    body.push(wide(`The first ${rows.length} of ${run.impactCount} impacts.`));
  }
  table.replaceChildren(
    element("thead", {}, element("tr", {}, ...titles)),
    element("tbody", {}, ...(body.length ? body : [wide("No impact.")])),
  );
}
