"""Does a haptic button survive?  From the force at the finger to the safety factor of its leaves.

    python examples/haptic_button/run.py

The key is held at many displacements: the force at the finger rises to a peak and falls, the click.
An independent value is the force of inclined leaves by the boundary value problem of a stretching
elastica.  Then a finger presses and releases the key.  The peak stress of this motion, with the hit
on the stop, gives safety factor and fatigue.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import root

from prbm import load, simulate
from prbm.analysis.strength import Loading, loadings
from prbm.analysis.stress_field import StressRecorder
from prbm.base.errors import PrbmError, SimulationError
from prbm.mechanics.assembly import assemble
from prbm.mechanics.statics import equilibrium
from prbm.mechanics.stress import static_stresses

BUTTON = load(str(Path(__file__).parent / "Button.toml"))
LEAVES = 4
FORCE, PRESS = 2.5, 0.08  # Largest force of the finger [N]; duration [s].
STOP_TIME = 0.1  # s
OPEN_ATOL = 1e-9  # m, rad: error at the end of a leaf

Real = NDArray[np.float64]


def held(travels: Real) -> tuple[Real, Real]:
    """Return the forces at the finger [N] and the largest stresses [Pa] over the travel [m]."""
    system = assemble(BUTTON, BUTTON.values())
    forces, stresses = [], []
    for travel in travels:
        shape = equilibrium(system, float(travel))
        forces.append(shape.force)
        stresses.append(max(x.largest for x in static_stresses(system, shape).values()))
    return np.array(forces), np.array(stresses)


def exact_forces(travels: Real) -> Real:
    """Return the forces at the finger [N] of stretching elastic lines that are guided at the key.

    The unknowns of a leaf are the force on its end and the moment at its start.
    """
    v = BUTTON.values()
    span, rise, h = v["leaf.span"], v["leaf.rise"], v["leaf.thickness"]
    length, angle = float(np.hypot(span, rise)), float(np.arctan2(rise, span))
    EA = v["titanium.youngs_modulus"] * h * v["leaf.width"]
    EI = EA * h**2 / 12
    scale = np.array([EI / length**2, EI / length**2, EI / length])

    def end(unknown: Real) -> Real:
        fx, fy, moment = unknown * scale

        def change(s: float, y: Real) -> list[float]:
            c, d = np.cos(y[2]), np.sin(y[2])
            stretched = 1.0 + (fx * c + fy * d) / EA
            return [stretched * c, stretched * d, (moment + fx * y[1] - fy * y[0]) / EI]

        # Equal steps: the error is then a smooth function of the unknowns.
        result: Real = solve_ivp(
            change, (0.0, length), [0.0, 0.0, angle], method="DOP853", rtol=1e-9, atol=1e-14,
            first_step=length / 20, max_step=length / 20,
        ).y[:, -1]  # fmt: skip
        return result

    found, guess = [], np.zeros(3)
    for travel in travels:
        if travel == 0.0:
            found.append(0.0)
            continue
        target = np.array([span, rise - travel, angle])
        solved = root(lambda x, at=target: (end(x) - at) / [length, length, 1.0], guess)
        guess = solved.x
        if np.abs(end(guess) - target).max() > OPEN_ATOL:
            raise SimulationError(f"the boundary value problem at {travel:g} m has no solution")
        found.append(-LEAVES * guess[1] * scale[1])
    return np.array(found)


def pressed() -> tuple[float, list[Loading]]:
    """Return the speed at which the key hits its stop [m/s], and the stress of one press."""
    recorder = StressRecorder()
    finger = {"finger.y": f"trapezoid(-{FORCE} N, {PRESS} s, 2 ms)"}
    result = simulate(BUTTON, inputs=finger, stop_time=STOP_TIME, step=2e-5, observer=recorder)
    speed = max((hit.latched.approach_speed for hit in result.impacts), default=0.0)
    return speed, loadings(result.columns, result.mechanism, stress=recorder.field)


def figure(travels: Real, forces: Real, exact: Real, stresses: Real) -> Figure:
    """Return a figure of force and stress over the travel."""
    drawn = Figure((7.0, 5.0), dpi=120, layout="constrained")
    above, below = drawn.subplots(2, 1, sharex=True)
    above.plot(1e3 * travels, exact, color="0.7", linewidth=4, label="boundary value problem")
    above.plot(1e3 * travels, forces, color="#1f4e79", label="beams of the order 3")
    above.set_ylabel("force at the finger [N]")
    below.plot(1e3 * travels, 1e-6 * stresses, color="#d55e00")
    below.set_ylabel("largest stress [MPa]")
    below.set_xlabel("travel [mm]")
    for axes in (above, below):
        axes.axvline(1e3 * BUTTON.values()["stop.position"], color="0.4", label="stop")
        axes.grid(alpha=0.3)
    above.legend()
    return drawn


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the force of the click, the speed at the stop, and the safety factor of the leaves."""
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args(arguments)
    try:
        travels = np.linspace(0.0, BUTTON.values()["stop.position"], 56)
        forces, stresses = held(travels)
        exact = exact_forces(travels)
        peak = int(forces.argmax())
        valley = peak + int(forces[peak:].argmin())
        print(f"click: {forces[peak]:.3f} N at {1e3 * travels[peak]:.2f} mm, then "
              f"{forces[valley]:.3f} N at {1e3 * travels[valley]:.2f} mm")  # fmt: skip
        print(f"boundary value problem: {exact.max():.3f} N, then {exact[valley]:.3f} N")
        print(f"largest stress, held at the stop: {1e-6 * stresses[-1]:.1f} MPa")
        speed, found = pressed()
        print(f"pressed with {FORCE:g} N: the key hits its stop with {speed:.3f} m/s")
        for one in found:
            print(f"{one.flexure:12} {1e-6 * one.peak:.1f} MPa, safety factor {one.safety:.2f}, "
                  f"damage {one.damage:.2g}")  # fmt: skip
        figure(travels, forces, exact, stresses).savefig("haptic_button.png")
    except PrbmError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
