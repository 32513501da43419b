// The kernel as a WebAssembly module: its memory, mechanisms and simulations.
//
// The functions of the module are those of kernel/engine.h.  Numbers are in SI units and rad.  A
// function that fails throws a KernelError with the message of the kernel.

const MESSAGE_LENGTH = 640; // Bytes of an error message.
const NUMBER = 8; // Bytes of a double.
const SLOT = 4; // Bytes of an int.
const UNFINISHED = -2; // ENGINE_UNFINISHED: prbm_advance is to be called again.

class KernelError extends Error {}

class Kernel {
  // Parameters: the instance of the module, which needs no imports.
  constructor(instance) {
    this.functions = instance.exports;
    this.functions._initialize();
    this.message = this.functions.malloc(MESSAGE_LENGTH);
  }

  static async compile(bytes) {
    const { instance } = await WebAssembly.instantiate(bytes, {});
    return new Kernel(instance);
  }

  // Views must not be kept: the memory may grow in the next call.
  numbers(address, count) {
    return new Float64Array(this.functions.memory.buffer, address, count);
  }

  allocate(bytes) {
    const address = this.functions.malloc(Math.max(bytes, NUMBER));
    if (!address) {
      throw new KernelError("there is not enough memory to simulate this mechanism");
    }
    return address;
  }

  error() {
    const bytes = new Uint8Array(this.functions.memory.buffer, this.message, MESSAGE_LENGTH);
    return new KernelError(new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0))));
  }

  // Read the tables of a mechanism (Uint8Array); return its address.
  mechanism(tables) {
    const address = this.allocate(tables.length);
    new Uint8Array(this.functions.memory.buffer, address, tables.length).set(tables);
    const mechanism = this.functions.prbm_mechanism_open(address, tables.length, this.message);
    this.functions.free(address);
    if (!mechanism) {
      throw this.error();
    }
    return mechanism;
  }
}

// A mechanism in motion from time 0.
//
// Parameters: the kernel, the address of the mechanism, the slots of the values to read, and a Map
// of slots to values of parameters and inputs that differ from their start values.
class Simulation {
  constructor(kernel, mechanism, slots, changes) {
    this.kernel = kernel;
    this.call = kernel.functions;
    this.address = this.call.prbm_open(mechanism);
    if (!this.address) {
      throw new KernelError("there is not enough memory to simulate this mechanism");
    }
    this.allocated = [];
    try {
      this.begin(slots, changes);
    } catch (error) {
      this.close();
      throw error;
    }
  }

  begin(slots, changes) {
    this.size = this.call.prbm_coordinates(this.address);
    this.slots = slots;
    this.slotsAt = this.reserve(SLOT * slots.length);
    new Int32Array(this.call.memory.buffer, this.slotsAt, slots.length).set(slots);
    this.valuesAt = this.reserve(NUMBER * (slots.length + 1));
    this.stateAt = this.reserve(NUMBER * (2 * this.size + 2));
    this.pointsAt = 0;
    for (const [slot, value] of changes) {
      this.kernel.numbers(this.valuesAt, 1)[0] = value;
      this.check(this.call.prbm_set(this.address, slot, 1, this.valuesAt, this.kernel.message));
    }
    this.call.prbm_record(this.address, 1);
    this.check(this.call.prbm_start(this.address, 0.0, 0.0, this.kernel.message));
    this.pointCount = this.call.prbm_point_count(this.address);
  }

  reserve(bytes) {
    const address = this.kernel.allocate(bytes);
    this.allocated.push(address);
    return address;
  }

  check(ok) {
    if (!ok) {
      throw this.kernel.error();
    }
  }

  // Continue to a time; return the impacts on the way.
  advance(time) {
    let count = UNFINISHED;
    while (count === UNFINISHED) {
      count = this.call.prbm_advance(this.address, time, this.kernel.message);
    }
    if (count < 0) {
      throw this.kernel.error();
    }
    return count > 0 ? this.takeImpacts(count) : [];
  }

  takeImpacts(count) {
    const n = this.size;
    const length = this.call.prbm_impact_size(this.address);
    const address = this.kernel.allocate(NUMBER * count * length);
    this.call.prbm_impacts(this.address, address);
    const impacts = [];
    for (let i = 0; i < count; i++) {
      const row = this.kernel.numbers(address + NUMBER * i * length, length);
      const [stop, number, time, approach, rebound, impulse, lost, modal, , ...contact] = row;
      const [peakForce, indentation, duration] = contact;
      impacts.push({
        stop,
        number,
        time,
        approach,
        rebound,
        impulse,
        lost,
        modal,
        peakForce,
        indentation,
        duration,
        q: row.slice(length - 3 * n, length - 2 * n),
      });
    }
    this.call.free(address);
    return impacts;
  }

  // Return the values of the slots at the present time.
  values() {
    const count = this.slots.length;
    this.check(
      this.call.prbm_values(this.address, count, this.slotsAt, this.valuesAt, this.kernel.message),
    );
    return this.kernel.numbers(this.valuesAt, count);
  }

  // Return the coordinates at the present time.
  coordinates() {
    this.check(this.call.prbm_state(this.address, this.stateAt, this.kernel.message));
    return this.kernel.numbers(this.stateAt, this.size);
  }

  // Return the points of a drawing at coordinates q, as pairs of x and y.
  points(q) {
    this.pointsAt ||= this.reserve(NUMBER * 2 * this.pointCount);
    this.kernel.numbers(this.stateAt, this.size).set(q);
    this.call.prbm_points(this.address, this.stateAt, this.pointsAt);
    return this.kernel.numbers(this.pointsAt, 2 * this.pointCount);
  }

  // Return the modes about the equilibrium under gravity, and the coordinates of that equilibrium.
  modes() {
    const n = this.size;
    const count = this.call.prbm_mode_count(this.address);
    const address = this.kernel.allocate(NUMBER * (n + count + count * n));
    const [q, frequencies, shapes] = [0, n, n + count].map((k) => address + NUMBER * k);
    try {
      const found = this.call.prbm_modes(this.address, q, frequencies, shapes, this.kernel.message);
      this.check(found >= 0);
      const read = (from, length) => this.kernel.numbers(from, length).slice();
      const modes = [...read(frequencies, count)].map((frequency, k) => ({
        frequency,
        shape: read(shapes + NUMBER * k * n, n),
      }));
      return { q: read(q, n), modes };
    } finally {
      this.call.free(address);
    }
  }

  close() {
    this.allocated.forEach((address) => this.call.free(address));
    this.call.prbm_close(this.address);
    this.allocated = [];
    this.address = 0;
  }
}
