// A run of a live page's kernel in Node, without a page.
//
// node live_host.js SCRIPTS MODULE.wasm: reads a job as JSON from standard input, and writes the result
// as JSON to standard output.  Numbers of the result keep all digits.
"use strict";
const { readFileSync } = require("node:fs");
const { join } = require("node:path");

const [folder, moduleFile] = process.argv.slice(2);
const source = ["engine.js", "run.js", "geometry.js"]
  .map((name) => readFileSync(join(folder, name), "utf8"))
  .join("\n");
const { Kernel, KernelError, Run, Shapes, Simulation } = new Function(
  `"use strict";\n${source}\nreturn { Kernel, KernelError, Run, Shapes, Simulation };`,
)();

// Simulate a job; return its impacts, the last values, and what the job requests in addition.
function result(kernel, job) {
  const mechanism = kernel.mechanism(Buffer.from(job.tables, "base64"));
  const start = performance.now();
  const changes = new Map((job.changes ?? []).map(([slot, x]) => [slot, Number(x)]));
  const simulation = new Simulation(kernel, mechanism, job.slots, changes);
  const run = new Run(simulation, job.steps, job.step);
  while (!run.finished) {
    run.next();
  }
  const found = {
    impacts: run.impacts.map((impact) => ({ ...impact, q: [...impact.q] })),
    last: job.slots.map((_, k) => run.last(k)),
    error: run.error?.message ?? null,
    milliseconds: performance.now() - start,
  };
  if (job.rows) {
    found.rows = Buffer.from(run.rows.buffer).toString("base64");
  }
  if (job.drawing) {
    Object.assign(found, drawing(simulation, run, job));
  }
  simulation.close();
  kernel.functions.prbm_mechanism_close(mechanism);
  return found;
}

// Return the points of the last shape, the modes, and the drawn lines and bodies.
function drawing(simulation, run, { content }) {
  const q = run.coordinates(run.time);
  const values = new Map(content.quantities.map(({ name, start }) => [name, start]));
  const shapes = new Shapes(content, values, simulation);
  const shape = shapes.at(q);
  const { modes, q: rest } = simulation.modes();
  return {
    q: [...q],
    points: [...simulation.points(q)],
    curves: shape.lines.map((line) => line.curve),
    edges: shape.lines.map((line) => line.edge ?? []),
    straight: shapes.straight.lines.map((line) => line.edge ?? line.curve),
    bodies: content.bodies.map((_, k) => shapes.body(k, shape.poses)),
    walls: content.stops.map((_, k) => shapes.wall(k, 0, shape.poses)),
    rest: [...rest],
    modes: modes.map((mode) => ({ frequency: mode.frequency, shape: [...mode.shape] })),
  };
}

async function main() {
  const kernel = await Kernel.compile(readFileSync(moduleFile));
  const job = JSON.parse(readFileSync(0, "utf8"));
  let found;
  const memory = [];
  try {
    for (let k = 0; k < (job.repeat ?? 1); k++) {
      found = result(kernel, job);
      memory.push(kernel.functions.memory.buffer.byteLength);
    }
  } catch (error) {
    if (!(error instanceof KernelError)) {
      throw error;
    }
    found = { error: error.message };
  }
  const text = JSON.stringify({ ...found, memory: [memory.at(0), memory.at(-1)] });
  process.stdout.write(text, () => process.exit()); // The channel of the slices stays open.
}

main();
