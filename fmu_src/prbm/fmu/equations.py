"""The equations in the documentation page of an FMU, for the parts that its mechanism has."""

from ..mechanism.description import Mechanism
from ..mechanism.flexure import BEAM
from ..mechanism.parts import COMPLIANT, LAWS, RIGID, FlexureType
from .mathml import block, escape, formula, inline, matrix, row

STRETCHING = (
    "where links that stretch have e = exp(s + i q), with a further coordinate s, the logarithm of "
    "the stretch (and v is q' - i s' where it is squared), "
)


SPRINGS = (
    f"<p>The force of a spring is {inline('k x + k_3 x^3 + c dot(l)')}, positive in tension, with "
    f"the elongation {inline('x = l - l_0')} of the distance {inline('l')} of its ends.</p>\n"
)
TORSION = (
    f"<p>Torsion at a joint has the moment {inline('k (phi - phi_0) + c dot(phi)')} against the "
    f"rotation {inline('phi')} of one body relative to the other since the drawn shape, with its "
    f"<code>stiffness</code>, <code>free_angle</code> {inline('phi_0')} and <code>damping</code>."
    "</p>\n"
)
ONE_SIDED = (
    f"<p>A spring that acts in tension or compression only has the force "
    f"{inline('s max(0, s (k x + k_3 x^3 + c dot(l)))')} where {inline('s x > 0')}, with "
    f"{inline('s = 1')} in tension and {inline('s = -1')} in compression, and none elsewhere.</p>\n"
)
FLOATING = (
    "where a body that nothing connects to the ground has e = x + i y, its displacement, and its "
    "derivatives by x and y in place of i e, "
)


BEAMS = (
    "The angles of the nodes of a beam are a constant linear map of the coordinates; the equations "
    "of the angles are multiplied by it. "
)


def _beams(mechanism: Mechanism) -> bool:
    return any(kind.model == BEAM for kind in mechanism.flexure_types)


def stretches(mechanism: Mechanism) -> bool:
    """Return whether flexures stretch."""
    return any(kind.axial for kind in mechanism.flexure_types)


STOP_LAWS = {
    RIGID: "<p>At an impact on a rigid stop,</p>\n"
    + formula(
        "M (v^+ - v^-) + Phi_q^T Lambda = G^T P",
        "Phi_q v^+ = 0",
        "dot(g)^+ = -restitution dot(g)^-",
        "P >= 0",
    )
    + "\n<p>With friction at the stop, the coefficient of restitution is energetic (Stronge), so "
    "that no impact gains energy. Without friction it equals Newton's coefficient.</p>\n",
    COMPLIANT: f"<p>A compliant stop with the indentation {inline('d = -g')} has the contact "
    "force</p>\n"
    + formula(
        "F = max(0, k d^n (1 + alpha dot(d)/v_0))",
        "(1 + alpha)/(1 - epsilon alpha) = exp((1 + epsilon) alpha)",
    )
    + f"\n<p>with {inline('k')} the <code>stiffness</code>, {inline('n')} the "
    f"<code>exponent</code>, {inline('epsilon')} the <code>restitution</code> of a point mass, and "
    f"{inline('v_0')} the largest closing speed of the contact so far, at least "
    "<code>rest_speed</code>. With friction at the stop, F is the normal force. A contact that "
    "has frozen holds like a rigid stop.</p>\n",
}


GUIDES = (
    f"<p>The rows of guides in {inline('Phi')} are the displacement of a point to the left of its "
    "line, and, if the body keeps its angle, the sine of this angle times the size, both in the "
    "frame of the body that carries the line.</p>\n"
)
RUBBING = (
    f"<p>A guide with friction that slides has the force {inline('-mu abs(lambda) sgn(v)')} along "
    "its line, with its multiplier as normal force.</p>\n"
)


def equations(mechanism: Mechanism) -> str:
    """Return the section of the equations of motion, impacts and flexures, in HTML."""
    beams = _beams(mechanism)
    motion = block(
        matrix([["M", "Phi_q^T", "-G^T"], ["Phi_q", "0", "0"], ["G", "0", "0"]]),
        matrix([["a"], ["lambda"], ["force"]]),
        row("="),
        matrix([["Q - C v^2"], ["-dot(Phi_q) v"], ["-dot(G) v"]]),
    )
    mass = formula("M = Re(bar(e)_i H_{ij} e_j) + diag(J)", "C = -Im(bar(e)_i H_{ij} e_j)")
    loads = "Q = springs + gravity + damping (2 zeta omega_1 M v + beta K v) + friction + inputs"
    laws = laws_of(mechanism)
    loads += " + G^T F" if COMPLIANT in laws else ""
    return (
        "<h2>Equations</h2>\n"
        f"<p>{BEAMS if beams else ''}With the absolute angles {inline('q')} of the links "
        f"{'and nodes ' if beams else ''}and {inline('e = exp(i q)')}, every point is "
        f"{inline('z = c + A e')}, {STRETCHING if stretches(mechanism) else ''}"
        f"{FLOATING if mechanism.floating_bodies else ''}and</p>\n"
        f"{motion}\n{mass}\n{formula(loads)}\n"
        "<p>The last row acts while a stop holds. "
        f"{inline('Phi(q) = 0')} are the loop constraints; positions and velocities are "
        "projected onto them. The gap "
        f"{inline('g')} has the rate {inline('dot(g) = G v + w')}, with {inline('w')} the velocity "
        f"of the wall.</p>\n{''.join(STOP_LAWS[law] for law in laws)}"
        f"{SPRINGS if mechanism.springs else ''}"
        f"{ONE_SIDED if any(s.side for s in mechanism.springs) else ''}"
        f"{TORSION if any(joint.elastic for joint in mechanism.joints) else ''}"
        f"{GUIDES if mechanism.guides else ''}"
        f"{RUBBING if any(g.friction is not None for g in mechanism.guides) else ''}"
        f"{_flexure_table(mechanism)}"
        "<p>Energy balance: kinetic + elastic + gravitational + dissipated energy - work is "
        "constant, also across impacts.</p>"
    )


def _flexure_table(mechanism: Mechanism) -> str:
    """Return the table of the flexure models; empty without flexures."""
    if not mechanism.flexure_types:
        return ""
    rows = "".join(_flexure_row(mechanism, kind) for kind in mechanism.flexure_types)
    return (
        '<div class="table"><table><caption>Flexure models</caption><thead><tr><th>type</th>'
        "<th>model</th><th>coefficients (published)</th><th>source</th></tr></thead><tbody>"
        f"{rows}</tbody></table></div>\n"
    )


def _flexure_row(mechanism: Mechanism, kind: FlexureType) -> str:
    model = mechanism.model(kind)
    coefficients = ", ".join(f"{c.name} = {c.value:g}" for c in model.coefficients)
    if model.order:
        coefficients = f"order = {model.order}, nodes = {model.nodes}, profile = {kind.profile}"
    coefficients = coefficients or f"n = {kind.n}"
    cells = (kind.name, kind.model, coefficients, model.source)
    return "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"


def laws_of(mechanism: Mechanism) -> list[str]:
    """Return the laws of the stops, the rigid one first; without stops the rigid one."""
    found = {stop.law for stop in mechanism.stops} or {RIGID}
    return [law for law in LAWS if law in found]
