"""Model exchange in the kernel: random states, directional derivatives, a simple importer."""

import numpy as np

from kernel_library import constants
from kernel_simulation import KernelSimulation
from prbm.mechanics.independent import independent
from prbm.mechanics.inputs import input_names


def contact_modes(guide, discrete):
    """Return the modes of all contacts for a discrete state of ``discrete_states``."""
    number, stops = constants(), len(guide.stops)
    names = {0: "STICK", 1: "SLIP_POSITIVE", -1: "SLIP_NEGATIVE", 2: "FRICTIONLESS"}
    holds, marks = discrete[:stops], discrete[stops:]
    chosen = [names[m] if h else "OPEN" for h, m in zip(holds, marks[:stops], strict=True)]
    return [number[f"CONTACT_{name}"] for name in chosen + [names[m] for m in marks[stops:]]]


def put(kernel, time, x, values):
    """Set inputs and parameters, the time and the states."""
    kernel.set(values)
    kernel.exchange_set(time, x)


def moving(guide, parameters, inputs, discrete, rng, contact=None, coils=()):
    """Return a kernel in a discrete state, and the states of a random motion.

    ``contact`` has phase, reference speed and depth of the contact at the first stop, ``coils`` the
    phases of springs.
    """
    kernel = KernelSimulation(guide, parameters, exchange=True)
    x, count = kernel.exchange_get(), len(independent(guide))
    names = [kernel.states[k] for k in range(count)]
    stretches = np.array([name.endswith(".strain") for name in names])
    x[:count] += np.where(stretches, 0.002, 0.02) * rng.standard_normal(count)
    x[count : 2 * count] = np.where(stretches, 0.3, 3.0) * rng.standard_normal(count)
    put(kernel, 0.0, x, inputs)
    if discrete:
        kernel.set_modes(contact_modes(guide, discrete))
    if contact:
        kernel.set_contact(0, *contact)
    if coils:
        kernel.set_coils(coils)
    put(kernel, 0.0, x, inputs)
    if contact:
        kernel.begin()
        put(kernel, 0.0, x, inputs)
    return kernel, x


def round_off(values, now):
    """Return the round-off of slopes by differences of fourth order, times their step.

    It is measured by steps that are too small for a change of the values.
    """
    near = [np.abs(values(step) - now) for step in (-2e-12, -1e-12, 1e-12, 2e-12)]
    return 2.0 * np.max(near, axis=0)  # The weights of a slope add up to 18/12.


def assert_directional(guide, parameters, inputs, discrete, contact=None, coils=()):
    """Compare directional derivatives with differences, for random changes of states and inputs.

    The error of differences of fourth order is 1e-8.  It is larger for a nearly singular pair of
    constraints (closed stop and sticking friction).  Round-off is not compared: the angular
    acceleration of a body that does not turn by symmetry has nothing else.
    """
    rng = np.random.default_rng(0)
    kernel, x = moving(guide, parameters, inputs, discrete, rng, contact, coils)
    count = len(independent(guide))
    names, given = list(kernel.slots), np.array([inputs.get(n, 0.0) for n in input_names(guide)])

    def values(step):
        moved = dict(zip(input_names(guide), given + step * du, strict=True))
        put(kernel, 0.0, x + step * dx, moved)
        return np.array([*kernel.outputs().values()])

    for _ in range(3):
        dx, du = rng.standard_normal(len(x)), rng.standard_normal(len(given)) * abs(given)
        dx[count : 2 * count] *= 30.0
        now = values(0.0)
        sizes, noise = np.abs(now), round_off(values, now)
        put(kernel, 0.0, x, dict(zip(input_names(guide), given, strict=True)))
        found = kernel.directional(dx, du)
        error = np.full(len(found), np.inf)
        for h in (2e-4, 6e-5, 2e-5):  # The smallest of the three errors is compared.
            slope = (8 * (values(h) - values(-h)) - (values(2 * h) - values(-2 * h))) / (12 * h)
            scale = np.abs(slope) + 1e-4 * (1.0 + sizes)
            error = np.minimum(error, (np.abs(found - slope) - noise / h) / scale)
        worst = int(error.argmax())
        assert error[worst] <= 1e-6, (names[worst], found[worst], error[worst])


def integrate(kernel, end, h=2e-5, inputs=lambda t: {}, *, completes=True):
    """Integrate by classical Runge-Kutta steps; locate events by bisection; yield each event.

    ``completes=False`` reports no completed steps, as importers that hide the steps of a solver.
    """
    t, x = 0.0, kernel.exchange_get()

    def f(t, x):
        kernel.set(inputs(t))
        kernel.exchange_set(t, x)
        return kernel.derivatives()

    def step(t, x, h):
        k1 = f(t, x)
        k2 = f(t + h / 2, x + h / 2 * k1)
        k3 = f(t + h / 2, x + h / 2 * k2)
        k4 = f(t + h, x + h * k3)
        return x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)

    def crossed(t, x):
        kernel.set(inputs(t))
        kernel.exchange_set(t, x)
        return (kernel.indicators() <= 0.0).any()

    while t < end:
        x1, size = step(t, x, h), h
        if crossed(t + h, x1):
            low, high = 0.0, h
            while high - low > 1e-13:
                middle = (low + high) / 2
                low, high = (
                    (low, middle) if crossed(t + middle, step(t, x, middle)) else (middle, high)
                )
            x1, size = step(t, x, high), high
        t += size
        kernel.set(inputs(t))
        kernel.exchange_set(t, x1)
        x = x1
        if (completes and kernel.completed_step()) or crossed(t, x1):
            kernel.exchange_set(t, x1)
            kernel.event()
            x = kernel.exchange_get()
            yield t, kernel.indicators()
