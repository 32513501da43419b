"""Compare the accelerations of two versions in random states of closed loops.

    git worktree add ../old cd58217e          # version 0.2
    python benchmarks/accelerations.py ../old . --states 1000 --random 20

The coordinates of a mechanism depend on the version: a beam that closes a loop may be laid from
either end.  Its mass points do not, so that they give the state.  The new version draws states on
the constraints.  The old one solves for its coordinates with the same positions and velocities of
all mass points and bodies, and computes the accelerations of the points, too.  The differences are
relative to the largest acceleration, and in units of the spread that round-off allows.  This is
epsilon times the condition of the scaled equations times the norm of their solution, multipliers
included, and the change by the remaining difference of the states.  A mechanism with nodes at other
places in the old version is not compared, and neither is a state that the old one does not find, or
in which a part is half a turn or more from its drawing.
"""

import argparse
import io
import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np

MODELS = (
    "PRBDM", "PRBDM2R", "PRBDM2RAxial", "PRBDM3R", "GuideBeam", "NotchGuide", "CurvedBistable",
    "FoldedSuspension", "Bistable",
)  # fmt: skip
SAME = 1e-11  # Largest relative difference of positions and velocities of a state.
SPREAD = 10.0  # Largest difference in units of the spread.
COMMON = """
import pickle, sys
import numpy as np
from prbm.base.errors import PrbmError
from prbm.hybrid.simulation import Simulation
from prbm.mechanics.contact_state import ContactState
from prbm.mechanics.dynamics import Equations

def model(mechanism):
    simulation = Simulation(mechanism)
    system = simulation.system
    free = ContactState.free(len(mechanism.stops), len(system.rubs))
    equations = Equations(system, simulation.inputs, free, simulation.configuration.omega)
    return simulation.front.y, system, equations

def points(system, q):
    "Return the places of the mass points, then the arms of the bodies, and the derivatives."
    e = system.directions(q)
    arms, bodies = system.arm == np.arange(len(e)), [b.arm for b in system.bodies.values()]
    A = np.vstack([system.A, system.length * np.eye(len(e))[bodies]])
    c = np.append(system.c, np.zeros(len(bodies)))
    J = 1j * A[:, system.arm] * e
    return c + A[:, arms] @ e[arms], J @ system.Phi.of(np.eye(system.n)).T

def turned(system, q):
    "Return whether a part is half a turn or more from its drawn direction."
    return np.abs(system.Phi.of(q - system.q0)).max() > np.pi

def solved(system, equations, q, v):
    "Return the accelerations of the mass points, and the spread by rounding of their solution."
    e, (_, J) = system.directions(q), points(system, q)
    turn, arms = system.Phi.of(v), system.arm == np.arange(system.A.shape[1])
    w = turn.astype(complex) * arms
    for j in np.flatnonzero(~arms):
        w[system.arm[j]] -= 1j * turn[j]
    found, rows = equations.evaluate(0.0, q, v), equations.rows.jacobian(e)
    kkt = np.block([[found.M, rows.T], [rows, np.zeros((len(rows), len(rows)))]])
    scale = 1.0 / np.sqrt(found.M.diagonal())
    scale = np.append(scale, 1.0 / np.abs(rows * scale).max(axis=1))
    bent = system.A[:, arms] @ (w[arms] ** 2 * e[arms])
    solution = np.linalg.norm(np.append(found.a, found.lam) / scale)
    reach = np.linalg.norm(J[: len(bent)] * scale[: system.n], axis=1).max()
    condition = np.linalg.cond(scale[:, None] * kkt * scale)
    spread = np.finfo(float).eps * condition * solution * reach
    return (J @ found.a)[: len(bent)] - bent, float(spread)
"""
MAKE = """
import sys
sys.path.insert(0, sys.argv[1])
from prbm.files.mechanism_file import read_mechanism, shipped
from random_mechanisms import seeded
names = sys.argv[3:]
made = {name: read_mechanism(shipped()[name]) for name in names if name in shipped()}
made |= {f"random {seed}": seeded(seed) for seed in range(int(sys.argv[2]))}
sys.stdout.buffer.write(pickle.dumps(made))
"""
DRAW = """
given, count = pickle.load(sys.stdin.buffer)
for k, (name, mechanism) in enumerate(given.items()):
    try:
        front, system, equations = model(mechanism)
    except PrbmError:
        continue
    n, rng, states = system.n, np.random.default_rng(k), []
    for _ in range(20 * count if len(system.loops) else 0):
        y = front.copy()
        y[:n] += rng.uniform(0.0, 0.1) * rng.normal(size=n)
        y[n : 2 * n] = rng.normal(size=n)
        try:
            y = equations.project(0.0, y)
            if turned(system, y[:n]):
                continue
            z, J = points(system, y[:n])
            v = y[n : 2 * n]
            states.append((z, J @ v, *solved(system, equations, y[:n], v)))
        except PrbmError:
            continue
        if len(states) == count:
            break
    if states:
        pickle.dump((name, points(system, system.q0)[0], system.m, states), sys.stdout.buffer)
"""
SOLVE = """
from scipy.optimize import linear_sum_assignment
given, drawn = pickle.load(sys.stdin.buffer)
for name, straight, masses, states in drawn:
    _, system, equations = model(given[name])
    p, mine, found = len(system.m), points(system, system.q0)[0], []
    apart = np.abs(mine[:p, None] - straight[: len(masses)]) / system.length
    apart += np.abs(np.log(system.m[:, None] / masses))
    own, theirs = linear_sum_assignment(apart)
    fits = len(mine) == len(straight) and len(own) == p and apart[own, theirs].max() < 1e-9
    order = np.append(theirs[np.argsort(own)], np.arange(len(masses), len(straight)))
    rng = np.random.default_rng(0)
    for z, speed, acceleration, spread in states if fits else ():
        q, real = system.q0.copy(), lambda x: np.concatenate([x.real, x.imag])
        for _ in range(20):
            now, J = points(system, q)
            change = np.linalg.lstsq(real(J), real(z[order] - now), rcond=1e-10)[0]
            q = q + change
            if np.abs(change).max() < 1e-14:
                break
        now, J = points(system, q)
        v = np.linalg.lstsq(real(J), real(speed[order]), rcond=1e-10)[0]
        off = max(np.abs(z[order] - now).max() / system.length,
                  np.abs(J @ v - speed[order]).max() / np.abs(speed).max())
        if turned(system, q) or not off < float(sys.argv[1]):
            found.append((1.0, 0.0, 1.0))
            continue
        a, other = solved(system, equations, q, v)
        largest = np.abs(acceleration).max()
        error = np.abs(a - acceleration[order[:p]]).max() / largest
        loosest = 1.0 / np.linalg.svd(real(J), compute_uv=False)[-1]  # Change of q by one of z.
        change = 0.0
        for x, size in ((q, system.length), (v, np.abs(speed).max())):
            step = 1e-7 * max(1.0, np.abs(x).max()) * rng.normal(size=len(x))
            near = (q + step, v) if x is q else (q, v + step)
            each = np.abs(solved(system, equations, *near)[0] - a).max() / np.abs(step).max()
            change += (off + np.finfo(float).eps) * size * loosest * each
        spread = (max(spread, other) + change) / largest
        found.append((off, error, spread))
    pickle.dump((name, found), sys.stdout.buffer)
"""


def run(clone: Path, script: str, *words: str, given: object = None) -> bytes:
    """Return what a script prints that runs with the package of a clone."""
    paths = [str(clone.resolve() / part) for part in ("fmu_src", "tests/support")]
    return subprocess.run(
        [sys.executable, "-c", COMMON + script, *words], input=pickle.dumps(given), check=True,
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths), "OPENBLAS_NUM_THREADS": "1"},
    ).stdout  # fmt: skip


def unpickled(text: bytes) -> list[tuple]:
    """Return the objects of consecutive pickles."""
    stream, found = io.BytesIO(text), []
    while stream.tell() < len(text):
        found.append(pickle.load(stream))
    return found


def main() -> int:
    """Print a line for each mechanism; return 1 if a difference exceeds the spread."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("clones", type=Path, nargs=2, metavar="CLONE", help="old, new")
    parser.add_argument("--states", type=int, default=500, help="of each mechanism (default: 500)")
    parser.add_argument(
        "--random", type=int, default=50, help="random mechanisms of the old clone (default: 50)"
    )
    parser.add_argument(
        "--model", action="append", help="shipped mechanism (default: all with loops)"
    )
    options = parser.parse_args()
    old, new = options.clones
    support = str((old / "tests" / "support").resolve())
    names = options.model or MODELS
    # Mechanisms are pickled by the old version; new fields have their defaults.
    given = pickle.loads(run(old, MAKE, support, str(options.random), *names))
    drawn = unpickled(run(new, DRAW, given=(given, options.states)))
    found = unpickled(run(old, SOLVE, str(SAME), given=(given, drawn)))
    total, good = 0, True
    for name, states in found:
        if not states:
            print(f"{name:18s} other mass points")
            continue
        off, error, spread = np.array([x for x in states if x[0] < SAME]).reshape(-1, 3).T
        if not len(off):
            print(f"{name:18s} no state with the same mass points")
            continue
        units = error / spread
        good &= bool(units.max() < SPREAD)
        total += len(off)
        print(
            f"{name:18s} {len(off):6d} of {len(states)} states, positions and velocities "
            f"{off.max():.0e}, accelerations: median {np.median(error):.0e}, largest "
            f"{error.max():.0e}, in units of the spread {units.max():.3g}",
            flush=True,
        )
    print(f"{total} states, {'within' if good else 'beyond'} {SPREAD:g} times the spread")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
