"""The documentation page of an FMU: summary, equations, variables, limits of the model."""

import html
import math
from collections.abc import Iterable, Sequence

from ..base.text import printable
from ..base.version import GENERATION_TOOL
from ..interface.native import NativeInterface
from ..interface.variables import Variable
from ..mechanism.description import Mechanism
from ..mechanism.parts import FlexureType
from ..runs.experiment import Experiment

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #222; max-width: 62rem; margin: 2rem auto;
  padding: 0 1rem; }
h1 { line-height: 1.2; } h2 { margin-top: 2.2rem; border-bottom: 1px solid #ccc; }
pre { background: #f5f7fa; padding: .8rem 1rem; overflow-x: auto; line-height: 1.3; }
code { background: #f5f7fa; padding: 0 .2em; } pre code { padding: 0; }
.table { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: .88rem; }
th, td { text-align: left; padding: .25rem .6rem; border-bottom: 1px solid #ddd;
  vertical-align: top; }
th { background: #eef3f8; } td.number { text-align: right; white-space: nowrap; }
td:first-child { white-space: nowrap; } caption { text-align: left; font-weight: 600;
  padding: .8rem 0 .3rem; } figure { margin: 1rem 0; }
"""

KINDS = {
    ("independent", "continuous"): "Independent variable",
    ("parameter", "fixed"): "Parameters, fixed when the simulation starts",
    ("parameter", "tunable"): "Parameters that may change while the simulation runs",
    ("calculatedParameter", "fixed"): "Calculated parameters",
    ("input", "continuous"): "Inputs",
    ("input", "discrete"): "Inputs that act when they change",
    ("output", "continuous"): "Outputs",
    ("output", "discrete"): "Outputs that an impact changes (latched)",
    ("local", "continuous"): "Local variables",
    ("local", "fixed"): "Local constants",
}

END_MOMENT = {"1R": 0.443, "2R": 0.772, "3R": 1.007}
"""Tip slope of a cantilever under an end moment, as a share of the exact one."""

SOURCES = (
    "S. Boersma, Modelling and Validation of the Impact Response in Compliant Mechanisms, MSc "
    "thesis, TU Delft, 2015.",
    "L. L. Howell, Compliant Mechanisms, Wiley, 2001 (1R).",
    "Y.-Q. Yu et al., Dynamic modeling of compliant mechanisms based on the pseudo-rigid-body "
    "model, J. Mech. Des. 127 (2005) 760 (1R, masses).",
    "Y.-Q. Yu, Z.-L. Feng, Q.-P. Xu, A pseudo-rigid-body 2R model of flexural beam in compliant "
    "mechanisms, Mech. Mach. Theory 55 (2012) 18 (2R).",
    "H.-J. Su, A pseudorigid-body 3R model, J. Mech. Robotics 1 (2009) 021008 (3R).",
    "H. Hencky, Über die angenäherte Lösung von Stabilitätsproblemen im Raum mittels der "
    "elastischen Gelenkkette, Der Eisenbau 11 (1920) 437 (nR).",
    "W. J. Stronge, Rigid body collisions with friction, Proc. R. Soc. A 431 (1990) 169 "
    "(restitution with friction).",
)


def escape(text: str) -> str:
    """Return a text as HTML has it, line by line."""
    return "\n".join(html.escape(printable(line)) for line in text.splitlines())


def page(mechanism: Mechanism, variables: tuple[Variable, ...], experiment: Experiment) -> str:
    """Return the HTML page of the Python FMU of a mechanism."""
    return _page(
        mechanism,
        _what(mechanism, "FMI 2.0 co-simulation"),
        _use(mechanism, experiment),
        _equations(mechanism),
        _variables(variables),
        _limits(mechanism, variables, INPUTS_OF_STEPS),
        _list("Sources", (escape(source) for source in SOURCES), ordered=True),
        _licenses(),
    )


def native_page(
    mechanism: Mechanism,
    interface: NativeInterface,
    version: int,
    platforms: Sequence[str],
    experiment: Experiment,
    with_reference: bool,
) -> str:
    """Return the HTML page of a native FMU.

    Parameters
    ----------
    mechanism, interface
        What was exported.
    version : {2, 3}
        Of FMI.
    platforms : sequence of str
        Where it runs.
    experiment : Experiment
        The default experiment.
    with_reference : bool
        Whether its results are inside.
    """
    variables = interface.variables
    return _page(
        mechanism,
        _what(mechanism, f"FMI {version}.0 model exchange and co-simulation"),
        _native_use(mechanism, interface, version, platforms, experiment, with_reference),
        _equations(mechanism),
        _exchange(interface, version),
        _events(mechanism, interface, version),
        _variables(variables),
        _limits(mechanism, variables, INPUTS_OF_BOTH),
        _list("Sources", (escape(source) for source in SOURCES), ordered=True),
        _native_licenses(platforms),
    )


def _page(mechanism: Mechanism, *sections: str) -> str:
    name = escape(mechanism.name)
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{name}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n"
        + "\n".join(sections)
        + "\n</body>\n</html>\n"
    )


def _list(title: str, items: Iterable[str], *, ordered: bool = False) -> str:
    tag = "ol" if ordered else "ul"
    lines = "\n".join(f"<li>{item}</li>" for item in items)
    return f"<h2>{title}</h2>\n<{tag}>\n{lines}\n</{tag}>"


def _what(mechanism: Mechanism, flavour: str) -> str:
    drawing = escape(mechanism.drawing.strip("\n"))
    figure = f"<figure><pre>{drawing}</pre></figure>" if drawing else ""
    return (
        f"<h1>{escape(mechanism.name)}</h1>\n"
        f"<p><strong>{escape(mechanism.title)}.</strong> "
        f"{escape(mechanism.description.strip())}</p>\n{figure}\n"
        "<p>Flexures are replaced by rigid links and torsion springs (a pseudo-rigid-body "
        "model), so that impacts follow the laws of rigid bodies: they are located to "
        "10<sup>-12</sup> s inside a communication step, and bouncing that dies out ends in "
        "resting contact, which releases when the contact force reaches zero. "
        f"{flavour}, made by {GENERATION_TOOL}.</p>"
    )


def _example(mechanism: Mechanism, experiment: Experiment, options: str = "") -> str:
    """Return what simulates an FMU with FMPy."""
    stops = [stop.name for stop in mechanism.stops]
    start = f'    start_values={{"{stops[0]}.restitution": 0.4}},\n' if stops else ""
    body = mechanism.release.body
    output = f'"{body}.x"' + "".join(f', "{stop}.impact_count"' for stop in stops)
    code = (
        "from fmpy import plot_result, simulate_fmu\n\n"
        f'result = simulate_fmu(\n    "{mechanism.name}.fmu",\n'
        f"    stop_time={experiment.stop_time:g},\n"
        f"{start}    output=[{output}],\n{options})\nplot_result(result)"
    )
    return f"<pre><code>{escape(code)}</code></pre>\n"


def _use(mechanism: Mechanism, experiment: Experiment) -> str:
    return (
        f"<h2>Use</h2>\n{_example(mechanism, experiment)}"
        "<p>Where it runs it needs <strong>Python 3.11 or later with NumPy and SciPy</strong>: "
        "inside a Python process (FMPy, PyFMI) nothing else; a tool that is not written in "
        "Python must find the Python library when it loads the FMU (on Linux for instance "
        "with <code>LD_PRELOAD=libpython3.11.so</code>). Linux and Windows on x86-64.</p>\n"
        "<p>Unpack it to a folder whose path is plain ASCII without <code>% # ?</code>: the "
        "wrapper library pythonfmu does not decode percent-encoded paths (other than a space) "
        "and crashes the host. For FMPy that is the folder of temporary files; set the "
        "environment variable <code>TMPDIR</code> (Linux) or <code>TMP</code> (Windows) if "
        "your user name has other letters.</p>\n"
        "<p>What is wrong with a value, a parameter set or a step is logged as a sentence, and "
        "every <code>doStep</code> answers <code>fmi2Discard</code> until a good value has put "
        "it right. What no value can put right needs a <code>reset</code>, and its sentence says "
        "so: setting an output or a value reference that is not in the model description, or a "
        "failure on the way. Getting a variable with the function of another type, or a value "
        "reference that is not in the model description, is refused too: the answer is NaN, 0 or "
        "false and a sentence, and the simulation goes on. FMPy ends the simulation early at "
        "<code>fmi2Discard</code>; the reasons are also on the standard error stream. The "
        "wrapper passes log messages on only if the importer asks for them (FMPy: "
        "<code>debug_logging=True</code>), impacts included.</p>"
    )


STRETCHING = (
    "where links that stretch have e = exp(s + i q), s the logarithm of their stretch, which is a "
    "coordinate, too (and v is q' - i s' where it is squared), "
)


def _stretches(mechanism: Mechanism) -> bool:
    return any(kind.axial for kind in mechanism.flexure_types)


def _equations(mechanism: Mechanism) -> str:
    flexures = "".join(_flexure_row(mechanism, kind) for kind in mechanism.flexure_types)
    return (
        "<h2>Equations</h2>\n"
        "<p>With the absolute angles q of the links and e = exp(i q), every point is "
        f"z = c + A e, {STRETCHING if _stretches(mechanism) else ''}and</p>\n<pre>"
        "[ M      Phi_q^T  -G^T ] [ a      ]   [ Q - C v^2        ]\n"
        "[ Phi_q  0         0   ] [ lambda ] = [ -(d/dt Phi_q) v  ]\n"
        "[ G      0         0   ] [ force  ]   [ -(d/dt G) v      ]   while a stop holds\n\n"
        "M = Re(conj(e)_i H_ij e_j) + diag(J),   C = -Im(conj(e)_i H_ij e_j)\n"
        "Q = springs + gravity + damping (2 zeta omega_1 M v + beta K v) + friction + inputs"
        "</pre>\n<p>Phi = 0 closes the loops; positions and velocities are projected onto "
        "it. At an impact, where the gap g closes at the rate g' = G v + w, w the velocity of "
        "the wall,</p>\n<pre>"
        "M (v+ - v-) + Phi_q^T Lambda = G^T P,   Phi_q v+ = 0,   g'+ = -restitution g'-,   P >= 0"
        "</pre>\n<p>With friction at the stop the coefficient of restitution is energetic "
        "(Stronge), so that no impact gains energy; without friction that is the same as "
        "Newton's.</p>\n"
        '<div class="table"><table><caption>Flexure models</caption><thead><tr><th>type</th>'
        "<th>model</th><th>coefficients (published)</th><th>source</th></tr></thead><tbody>"
        f"{flexures}</tbody></table></div>\n"
        "<p>Kinetic + elastic + gravitational + dissipated energy - work is constant, "
        "through impacts too.</p>"
    )


def _flexure_row(mechanism: Mechanism, kind: FlexureType) -> str:
    model = mechanism.model(kind)
    coefficients = ", ".join(f"{c.name} = {c.value:g}" for c in model.coefficients)
    coefficients = coefficients or f"n = {kind.n}"
    cells = (kind.name, kind.model, coefficients, model.source)
    return "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"


def _variables(variables: tuple[Variable, ...]) -> str:
    parts = ["<h2>Variables</h2>", "<p>SI units and radians.</p>"]
    for (causality, variability), title in KINDS.items():
        kind = [v for v in variables if (v.causality, v.variability) == (causality, variability)]
        if kind:
            parts.append(_table(title, kind))
    return "\n".join(parts)


def _table(title: str, variables: list[Variable]) -> str:
    with_start = any(v.start is not None for v in variables)
    head = ["name", "unit", *(["default", "range"] if with_start else []), "meaning"]
    rows = []
    for v in variables:
        cells = [f"<td><code>{escape(v.name)}</code></td>"]
        cells.append(f"<td>{escape(v.unit if v.type == 'Real' else v.type)}</td>")
        if with_start:
            cells.append(f'<td class="number">{v.start:.6g}</td>')
            cells.append(f'<td class="number">{_range(v)}</td>')
        cells.append(f"<td>{escape(v.description)}</td>")
        rows.append(f"<tr>{''.join(cells)}</tr>")
    titles = "".join(f'<th scope="col">{title}</th>' for title in head)
    return (
        f'<div class="table"><table><caption>{title}</caption><thead><tr>{titles}</tr></thead>'
        f"<tbody>\n{chr(10).join(rows)}\n</tbody></table></div>"
    )


def _range(v: Variable) -> str:
    low = f"{v.minimum:g}" if math.isfinite(v.minimum) else ""
    high = f"{v.maximum:g}" if math.isfinite(v.maximum) else ""
    if low and high:
        return f"{low} to {high}"
    return f"&ge; {low}" if low else f"&le; {high}" if high else ""


INPUTS_OF_STEPS = (
    "Inputs are constant within a communication step; outputs at a communication point do "
    "not depend on the inputs that are set there."
)
INPUTS_OF_BOTH = (
    "In co-simulation inputs are constant within a communication step. In model exchange "
    "<code>displacement</code> of a wall is used as it is, and its <code>velocity</code> "
    "should be its rate."
)


def _limits(mechanism: Mechanism, variables: tuple[Variable, ...], inputs: str) -> str:
    models = {kind.model for kind in mechanism.flexure_types}
    impact = "An impact of rigid bodies has an impulse, but no duration and no peak of force."
    planar = (
        "The motion is planar; flexures are slender, of uniform section and linear elastic "
        "material, and neither yield nor touch each other."
    )
    rigid = [
        f"{impact} A real hit of 0.1 ms is comparable to the axial vibrations of the flexures "
        "(0.5 ms in the steel structure of the source), which this model does not have: its links "
        "do not stretch.",
        planar,
        "Links that do not stretch keep a body on parallel, straight flexures from turning, so "
        "that the place of a hit has no effect there. With flexures that stretch, a rigid impact "
        "off the centre of mass loses more energy of the fundamental mode. The loss of a real one "
        "depends on the duration of its contact.",
    ]
    items = [impact, planar] if _stretches(mechanism) else rigid
    for model in sorted(models & END_MOMENT.keys()):
        items.append(
            f"End moments are the weak side of pivots: under a moment at its end, the tip of a "
            f"{model} cantilever turns by {END_MOMENT[model]:g} of what it should. Loads across "
            "the end are modelled well."
        )
    straight = "kilohertz" if _stretches(mechanism) else "infinite stiffness"
    if "2R" in models:
        items.append(
            "Without damping the motion of a guide on 2R flexures through its straight shape is "
            f"chaotic: two of its modes go from about a hundred hertz to {straight} there. A "
            "little damping in proportion to stiffness cures that, hence the default of "
            f"<code>damping.beta</code> ({_default('damping.beta', variables)} s). With none, "
            "single impacts mean little after a few bounces."
        )
    if mechanism.stops:
        items.append(
            "Below <code>rest_speed</code> an impact ends in rest if the stop stays pressed; "
            "bouncing then ends earlier by at most 2 eps v / (a (1 - eps)), with v that speed, "
            "eps the restitution and a the pressing acceleration."
        )
        items.append(
            "The wall never jumps: within a communication step it moves uniformly from where "
            "it was to <code>position + displacement + velocity h</code>, and that velocity "
            "enters the impact law; in a step shorter than one before, a wall with a velocity "
            "takes longer to make good what it is off. Several impacts within one communication "
            "step are all computed and counted; the latched outputs show the last one."
        )
        items.append(
            "A wall that retreats lets go of what rests on it: <code>contact</code> becomes false "
            "and the gap opens. What presses the body closes the gap again; it bounces on the "
            "moving wall, each impact counted, until one below <code>rest_speed</code> captures "
            "it, and then goes with the wall. A wall that advances strikes what rests on it."
        )
        items.append(
            "A wall that is part of another model takes part in impacts by its "
            "<code>mobility</code>: the impulse is that between two masses, the wall changes its "
            "velocity within the step, and <code>impulse_sum</code> is what the other model has to "
            "receive. With <code>mobility</code> 0 the wall is immovable."
        )
    items.append(inputs)
    return _list("Limits", items)


def _default(name: str, variables: tuple[Variable, ...]) -> str:
    return next(f"{v.start:g}" for v in variables if v.name == name)


def _licenses() -> str:
    return (
        "<h2>Licences</h2>\n<p>The model and its engine: MIT, see "
        '<a href="licenses/prbm-impact.txt">licenses/prbm-impact.txt</a>. The wrapper library '
        'pythonfmu: MIT, see <a href="licenses/pythonfmu.txt">licenses/pythonfmu.txt</a>.</p>'
    )


# --- native FMUs --------------------------------------------------------------------------------


def _native_use(
    mechanism: Mechanism,
    interface: NativeInterface,
    version: int,
    platforms: Sequence[str],
    experiment: Experiment,
    with_reference: bool,
) -> str:
    reference = (
        " The folder <code>extra</code> holds the outputs of the default experiment as the Python "
        "engine computes them, to compare with."
        if with_reference
        else ""
    )
    event_mode = "    use_event_mode=True,\n    early_return_allowed=True,\n"
    options = event_mode if interface.clocks else ""
    parts = [
        f"<h2>Use</h2>\n{_example(mechanism, experiment, options)}",
        "<p>It needs <strong>nothing where it runs</strong>: no Python, no library but that of "
        f"the C language. Inside are libraries for {', '.join(platforms)}, and the C source with "
        "the mechanism as a constant array, for other platforms and for targets without a file "
        f"system (<code>fmpy compile {mechanism.name}.fmu</code>). The same library serves every "
        "mechanism; <code>resources/mechanism.bin</code> is the mechanism, which it reads when an "
        f"instance is made and checks against the token of this FMU.{reference}</p>",
        "<p>For model exchange give FMPy <code>fmi_type=&quot;ModelExchange&quot;</code>. The "
        "solver of the importer should make steps that are short beside the time between two "
        "bounces, or it may step over a touch that is over before the step ends (CVode in FMPy "
        "takes at most a fiftieth of the whole time).</p>",
        "<p>What is wrong with a value, a call or a step is refused with a sentence in the log, "
        "and changes nothing. The state of an instance can be saved, written to bytes and "
        "restored, to the last bit. Every instance is on its own; use each in one thread at a "
        "time.</p>",
    ]
    if version == 3 and not interface.clocks:
        parts.append(
            "<p>Event mode is up to the importer: with <code>use_event_mode=True</code> and "
            "<code>early_return_allowed=True</code> FMPy records each impact twice, before and "
            "after it.</p>"
        )
    return "\n".join(parts)


def _exchange(interface: NativeInterface, version: int) -> str:
    rows = "".join(
        f"<tr><td><code>{escape(state)}</code></td><td><code>{escape(derivative)}</code></td></tr>"
        for state, derivative in zip(interface.states, interface.derivatives, strict=True)
    )
    discard = f"fmi{version}Discard"
    return (
        "<h2>Model exchange</h2>\n"
        "<p>The loops tie the angles q of the mechanism together, Phi(q) = 0. The states are the "
        "angles and rates of independent coordinates q_i, as many as there are ways to move; the "
        "dependent ones q_d are solved from the loops at every call, so that a solver that knows "
        "nothing of constraints stays on them:</p>\n<pre>"
        "Phi(q_i, q_d) = 0,      v_d = -(dPhi/dq_d)^-1 (dPhi/dq_i) v_i"
        "</pre>\n"
        '<div class="table"><table><caption>Continuous states, in order</caption><thead><tr>'
        "<th>state</th><th>derivative</th></tr></thead><tbody>"
        f"{rows}</tbody></table></div>\n"
        "<p>Which coordinates are independent was chosen at the export, so that dPhi/dq_d is as "
        "far from singular as it can be between the straight shape and the release of the "
        "mechanism file; start values do not change the choice. Far outside these shapes it can "
        "turn singular: then derivatives cannot be computed and the call answers "
        f"<code>{discard}</code> with a sentence. Co-simulation has no such place, "
        "because it works with all coordinates and projects them onto the loops.</p>\n"
        "<p>Directional derivatives of outputs and derivatives along states and inputs are exact. "
        "A stop that holds is a constraint on the accelerations; what an importer's solver lets it "
        "drift is taken back when it has completed a step, and every state may be set anew at an "
        "event.</p>"
    )


def _events(mechanism: Mechanism, interface: NativeInterface, version: int) -> str:
    if not (mechanism.stops or mechanism.frictions):
        return "<h2>Events</h2>\n<p>This mechanism has none.</p>"
    parts = [
        "<h2>Events</h2>\n<p>A stop closes (an impact, or its capture into rest), a stop that "
        "holds lets go, and what is subject to friction sticks or begins to slide. Each has an "
        "event indicator, which changes its sign there; indicators are scaled to the order of 1 "
        "and never 0 after an event.</p>",
        "<p>At an event, values are those <em>before</em> it until it has been handled: in model "
        "exchange when the discrete states are updated in event mode. In co-simulation without "
        "event mode impacts happen inside a step; the latched outputs tell of the last one, and "
        "their counter of all.</p>",
    ]
    if version == 3:
        parts.append(
            "<p>In co-simulation with event mode a step ends early at the event, at its exact "
            "time, if the importer allows it; the velocities change in "
            "<code>fmi3UpdateDiscreteStates</code>. If it does not allow it, impacts happen "
            "inside the step.</p>"
        )
    if interface.clocks:
        names = ", ".join(f"<code>{escape(name)}</code>" for name in interface.clocks)
        parts.append(
            f"<p>The output clock {names} ticks in event mode at each impact. An importer that "
            "uses this FMU must support event mode; the FMU without the clock leaves that to "
            "it.</p>"
        )
    return "\n".join(parts)


def _native_licenses(platforms: Sequence[str]) -> str:
    windows = (
        ' The libraries for Windows contain start-up code of MinGW-w64: see <a href="licenses/'
        'mingw-w64.txt">licenses/mingw-w64.txt</a>.'
        if any(name.endswith("-windows") for name in platforms)
        else ""
    )
    return (
        "<h2>Licences</h2>\n<p>The model and its engine: MIT, see "
        '<a href="licenses/prbm-impact.txt">licenses/prbm-impact.txt</a>. The headers of FMI, '
        'from which it was compiled: BSD with 2 clauses, see <a href="licenses/fmi-headers.txt">'
        f"licenses/fmi-headers.txt</a>.{windows}</p>"
    )
