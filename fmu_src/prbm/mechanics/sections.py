r"""Forces and moments at the ends and in the sections of flexures.

Each flexure is a free body between the two bodies that it connects.  Its own loads P are gravity,
inertia and mass-proportional damping of its mass points.  The force on its far end is

* the multiplier of the loop, if the flexure closes one;
* otherwise the sum of all other forces on the far body: its own loads, inputs, contacts and the
  forces of the other flexures and joints there.

The force on the near end follows from the balance of the forces.  The moment on each end follows
from the equation of motion of the flexure for a virtual rotation of this end, at a clamp on the
ground, too:

    moment = dU/dq - sum_i P_i . dz_i/dq - F_far . dz_far/dq,

with the elastic energy U (and the damping of the springs), and with the near end at rest.  In a
beam the rotation of an end turns the nodes by 1 - S_0 or S_0 (:mod:`prbm.mechanics.beam`).  In
other models it turns the stub at this end, so that the torque of the first spring is transported to
the clamp by the force of the joint.

Between the ends, the moment of a beam is its polynomial, and the moment at a pivot of other models
is the torque of its spring.
"""

from collections.abc import Iterable, Mapping

from ..mechanism.parts import GROUND, Guide
from .arrays import Complex, Real
from .contact_state import ContactMode
from .dynamics import Equations, Evaluation, sliding_friction
from .elements import Elements
from .free_body import SectionLoads
from .inputs import checked_loads
from .kinetics import mass_accelerations
from .statics import Equilibrium
from .system import FIXED, System, unit

Pulls = Iterable[tuple[str, complex]]


def connection_loads(
    system: System,
    e: Complex,
    deflection: Real,
    strained: Real,
    loads: Complex,
    pulls: Pulls,
    lam: Real,
) -> tuple[list[SectionLoads], complex]:
    """Return the forces and moments of all flexures, and the force on the ground.

    Parameters
    ----------
    system : System
        The mechanism.
    e, deflection, strained
        As :meth:`FreeBody.section_loads`.
    loads : (p,) complex
        Gravity, inertia and damping of all mass points [N].
    pulls : iterable of (str, complex)
        Other forces on bodies than those of guides, by the name of the body [N].
    lam : (r,)
        Multipliers, those of the loops first [N].

    Returns
    -------
    list of SectionLoads
        In the order of the flexures of the mechanism.
    complex
        Sum of the forces of flexures, joints and pulls on the ground [N].
    """
    on = {name: complex(loads[k]) for name, k in system.body_masses.items()} | {GROUND: 0j}
    for name, force in (*pulls, *guide_forces(system, e, lam)):
        on[name] += force
    closing = [c for c in system.connections if c.loop is not None]
    tree = [c for c in system.connections if c.loop is None]
    found: dict[str, SectionLoads] = {}
    for connection in (*closing, *reversed(tree)):
        flexure = connection.flexure
        own = loads[flexure.masses] if flexure else loads[:0]
        if connection.loop is None:
            far = on[connection.far]
        else:
            x, y = lam[2 * connection.loop : 2 * connection.loop + 2].tolist()
            stub = flexure.stub if flexure else 0
            far = complex(x, y) - complex(own[len(own) - stub :].sum())
            on[connection.far] -= far
        on[connection.near] += far + complex(own.sum())
        if flexure:
            found[flexure.name] = flexure.section_loads(e, deflection, strained, own, far)
    return [found[flexure.name] for flexure in system.mechanism.flexures], on[GROUND]


def section_loads(
    equations: Equations, q: Real, v: Real, found: Evaluation
) -> tuple[list[SectionLoads], complex]:
    """Return the forces and moments of all flexures in motion, and the force on the ground [N].

    The force on the ground does not include mass-proportional damping.

    Parameters
    ----------
    equations : Equations
        Equations of motion.
    q, v : (n,)
        Coordinates [rad] and rates [rad/s].
    found : Evaluation
        Evaluation there.
    """
    system = equations.system
    e, deflection = system.directions(q), q - system.rest
    loads = point_loads(equations, e, v, found.a)
    pulls = [*_inputs(equations), *contact_forces(equations, e, found)]
    if equations.elements.springs is not None:
        pulls += equations.elements.springs.pulls(e, v)
    strained = deflection + equations.beta * v
    return connection_loads(system, e, deflection, strained, loads, pulls, found.lam)


def static_section_loads(
    system: System, shape: Equilibrium, inputs: Mapping[str, float] | None = None
) -> list[SectionLoads]:
    """Return the forces and moments of all flexures in a static shape.

    Parameters
    ----------
    system : System
        The mechanism.
    shape : Equilibrium
        The shape, free or held.
    inputs : mapping or None
        The forces that act there, as for :func:`prbm.mechanics.statics.equilibrium`.

    Raises
    ------
    ParameterError
        If a load is unknown, or not a finite number.
    """
    mechanism = system.mechanism
    given = checked_loads(mechanism, inputs or {})
    pulls = [
        (f.body, complex(given[f"{f.name}.x"], given[f"{f.name}.y"])) for f in mechanism.forces
    ]
    if not mechanism.release.turns:
        release = mechanism.release
        pulls.append((release.body, shape.force * unit(release.direction)))
    e, deflection = system.directions(shape.q), shape.q - system.rest
    springs = Elements(system).springs
    if springs is not None:
        pulls += springs.pulls(e)
    loads = (system.m * system.gravity).astype(complex)
    return connection_loads(system, e, deflection, deflection, loads, pulls, shape.lam)[0]


def point_loads(equations: Equations, e: Complex, v: Real, a: Real) -> Complex:
    """Return gravity, inertia and mass-proportional damping of all mass points, (p,) [N]."""
    system = equations.system
    bent = mass_accelerations(system.A, e, system.turning(v), system.swing(e, a))
    change = system.gravity - equations.inputs.base - bent
    if equations.mass_damping:
        change = change - equations.mass_damping * 1j * (system.A @ system.swing(e, v))
    result: Complex = system.m * change
    return result


def guide_forces(system: System, e: Complex, lam: Real) -> Pulls:
    """Yield the forces of the guides on bodies and on the ground."""
    for guide, rows in zip(system.mechanism.guides, system.guided, strict=True):
        on = system.loops_on[rows.across]
        normal = rows.normal * (1.0 if on == FIXED else complex(e[on]))
        pull = float(lam[rows.across]) * normal
        yield guide.body, pull
        yield guide.on, -pull


def _inputs(equations: Equations) -> Pulls:
    """Yield the forces of the inputs on bodies."""
    for force, pull in zip(equations.system.mechanism.forces, equations.inputs.forces, strict=True):
        yield force.body, pull


def contact_forces(equations: Equations, e: Complex, found: Evaluation) -> Pulls:
    """Yield the forces of closed stops, and of friction, on bodies and on the ground."""
    system, modes = equations.system, equations.contacts.modes
    lam, pressure = found.lam, found.pressure
    for i, force in enumerate(equations.stop_forces(lam, pressure).tolist()):
        if not modes[i].closed:
            continue
        stop = system.mechanism.stops[i]
        u = unit(stop.direction) * (1.0 if system.on[i] == FIXED else complex(e[system.on[i]]))
        along = 0.0
        if modes[i] is ContactMode.STICK:
            along = equations.friction(i, e, lam, pressure)[0]
        elif modes[i].slip:
            along = -modes[i].slip * sliding_friction(equations, i, e, found)
        pull = u * complex(-force, along)
        yield stop.body, pull
        yield stop.on, -pull
    for k, part in enumerate(system.mechanism.rubbing):
        contact, carrier = equations.contacts.stops + k, int(system.rubs_on[k])
        if modes[contact] is ContactMode.STICK:
            size = equations.friction(contact, e, lam)[0]
        elif modes[contact].slip:
            size = -modes[contact].slip * sliding_friction(equations, contact, e, found)
        else:
            continue
        if isinstance(part, Guide):
            direction = -1j * system.guided[system.mechanism.guides.index(part)].normal
        else:
            direction = unit(part.direction)
        pull = size * direction * (1.0 if carrier == FIXED else complex(e[carrier]))
        yield part.body, pull
        yield (part.on if isinstance(part, Guide) else GROUND), -pull
