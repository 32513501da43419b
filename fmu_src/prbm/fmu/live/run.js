// A simulation in short slices, so that the page answers while it is computed.

const SLICE = 8; // Milliseconds of computation between two looks at the user's actions.
const IMPACTS_KEPT_MAX = 10000; // Largest number of impacts that are kept for the table and the film.

// Call a function soon, after the browser has handled waiting events.
const later = (() => {
  const channel = new MessageChannel();
  const waiting = [];
  channel.port1.onmessage = () => waiting.shift()();
  return (action) => {
    waiting.push(action);
    channel.port2.postMessage(0);
  };
})();

// The result of a simulation so far: rows of values and coordinates, and impacts.
class Run {
  constructor(simulation, steps, step) {
    this.simulation = simulation;
    this.steps = steps;
    this.step = step;
    this.width = simulation.slots.length;
    this.size = simulation.size;
    this.rows = new Float64Array((steps + 1) * this.width);
    this.states = new Float64Array((steps + 1) * this.size);
    this.count = 0; // Rows that have been computed.
    this.impacts = [];
    this.impactCount = 0;
    this.lost = 0; // Energy lost in all impacts [J].
    this.error = null;
    this.keep();
  }

  get finished() {
    return this.count > this.steps || this.error !== null;
  }

  // The last time that has been computed [s].
  get time() {
    return (this.count - 1) * this.step;
  }

  keep() {
    this.rows.set(this.simulation.values(), this.count * this.width);
    this.states.set(this.simulation.coordinates(), this.count * this.size);
    this.count += 1;
  }

  // Compute one row.  An error of the kernel ends the run.
  next() {
    try {
      const impacts = this.simulation.advance(this.count * this.step);
      this.impactCount += impacts.length;
      this.lost += impacts.reduce((sum, impact) => sum + impact.lost, 0);
      if (this.impacts.length < IMPACTS_KEPT_MAX) {
        this.impacts.push(...impacts);
      }
      this.keep();
    } catch (error) {
      if (!(error instanceof KernelError)) {
        throw error;
      }
      this.error = error;
    }
  }

  // Return a value at a row.
  at(row, column) {
    return this.rows[row * this.width + column];
  }

  last(column) {
    return this.at(this.count - 1, column);
  }

  // Return the index of the first impact after a time.
  impactAfter(time) {
    let low = 0;
    let high = this.impacts.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.impacts[middle].time > time) {
        high = middle;
      } else {
        low = middle + 1;
      }
    }
    return low;
  }

  // Return the coordinates at a time: linear between the rows, and exact at impacts.
  coordinates(time) {
    const n = this.size;
    const row = Math.max(0, Math.min(Math.floor(time / this.step), this.count - 2));
    const ends = [this.node(row), this.node(Math.min(row + 1, this.count - 1))];
    const next = this.impactAfter(time);
    const [before, after] = [this.impacts[next - 1], this.impacts[next]];
    if (before && before.time > ends[0].time) {
      ends[0] = before;
    }
    if (after && after.time < ends[1].time) {
      ends[1] = after;
    }
    const [a, b] = ends;
    const share =
      b.time > a.time ? Math.min(1, Math.max(0, (time - a.time) / (b.time - a.time))) : 0;
    return Float64Array.from({ length: n }, (_, k) => a.q[k] + share * (b.q[k] - a.q[k]));
  }

  node(row) {
    const from = row * this.size;
    return { time: row * this.step, q: this.states.subarray(from, from + this.size) };
  }
}

// Compute a run in slices.  report(run) is called after each slice.  Return a function that ends
// the computation.
function compute(run, report) {
  let active = true;
  const slice = () => {
    if (!active) {
      return;
    }
    const end = performance.now() + SLICE;
    do {
      run.next();
    } while (!run.finished && performance.now() < end);
    report(run);
    if (!run.finished) {
      later(slice);
    }
  };
  later(slice);
  return () => {
    active = false;
  };
}
