"""The documentation page of an FMU: summary, use, equations, variables, limits of the model."""

import math
from collections.abc import Iterable, Iterator, Sequence

from ..base.version import GENERATION_TOOL
from ..interface.native import NativeInterface
from ..interface.variables import Variable
from ..mechanics.inputs import Wall
from ..mechanics.stress import stressed
from ..mechanism.description import Mechanism
from ..mechanism.flexure import BEAM, MODELS
from ..mechanism.parts import COMPLIANT, RIGID
from ..runs.experiment import Experiment
from .equations import equations, laws_of, stretches
from .live.page import LivePart
from .mathml import escape, formula, inline
from .policy import policy
from .related import FOLDER

STYLE = """
:root { color-scheme: light dark; --text: #1d2530; --muted: #566170; --page: #f6f8fa;
  --card: #ffffff; --line: #d9dfe6; --edge: #b3bcc7; --grid: #e6eaef; --field: #f6f8fa;
  --code: #eef2f6; --anchor: #1c5f9f; --warn: #fff1e5; --warn-text: #5c2600;
  --handle-text: #a34100; }
@media (prefers-color-scheme: dark) { :root { --text: #e4eaf1; --muted: #a3afbd; --page: #10161d;
  --card: #18202a; --line: #2d3845; --edge: #4b5867; --grid: #263140; --field: #10161d;
  --code: #1f2935; --anchor: #7fbcf5; --warn: #3a2110; --warn-text: #ffd9bd;
  --handle-text: #ffab73; } }
body { font: 16px/1.5 system-ui, sans-serif; color: var(--text); background: var(--page);
  max-width: 86rem; margin: 2rem auto; padding: 0 1.25rem; }
body > p, body > ul, body > ol, body > .table { max-width: 64rem; }
a { color: var(--anchor); }
h1 { line-height: 1.2; margin-bottom: .5rem; }
h2 { margin-top: 2.2rem; border-bottom: 1px solid var(--line); }
pre { background: var(--code); padding: .8rem 1rem; overflow-x: auto; line-height: 1.3;
  max-width: 62rem; border-radius: 6px; }
code { background: var(--code); padding: 0 .2em; } pre code { padding: 0; }
.table { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: .88rem; }
th, td { text-align: left; padding: .25rem .6rem; border-bottom: 1px solid var(--line);
  vertical-align: top; }
th { background: var(--code); } td.number { text-align: right; white-space: nowrap; }
td:first-child { white-space: nowrap; } caption { text-align: left; font-weight: 600;
  padding: .8rem 0 .3rem; } figure { margin: 1rem 0; }
math[display=block] { margin: .9rem 0; text-align: left; display: block math; font-size: 1.08em;
  overflow-x: auto; overflow-y: hidden; max-width: 62rem; padding: .2em 0; }
mtd { padding: .15em .6em; }
.matrix { margin: 0 .3em; --c: linear-gradient(currentColor, currentColor); background:
  var(--c) 0 0/6px 1.5px, var(--c) 0 100%/6px 1.5px, var(--c) 100% 0/6px 1.5px,
  var(--c) 100% 100%/6px 1.5px; background-repeat: no-repeat;
  border-left: 1.5px solid currentColor; border-right: 1.5px solid currentColor; }
@media (max-width: 36rem) { .table td:last-child { min-width: 15rem; } }
figure svg { color: var(--anchor); max-width: 100%; height: auto; }
"""

KINDS = {
    ("independent", "continuous"): "Independent variable",
    ("parameter", "fixed"): "Parameters, fixed when the simulation starts",
    ("parameter", "tunable"): "Parameters that may change while the simulation runs",
    ("calculatedParameter", "fixed"): "Calculated parameters",
    ("input", "continuous"): "Inputs",
    ("input", "discrete"): "Inputs that act at the instant of their change",
    ("output", "continuous"): "Outputs",
    ("output", "discrete"): "Latched outputs, which only contact events change",
    ("local", "continuous"): "Local variables",
    ("local", "fixed"): "Local constants",
}

SOURCES = (
    "S. Boersma, Modelling and Validation of the Impact Response in Compliant Mechanisms, MSc "
    "thesis, TU Delft, 2015.",
    *(reference for model in MODELS.values() for reference in model.references),
    "W. J. Stronge, Rigid body collisions with friction, Proc. R. Soc. A 431 (1990) 169 "
    "(restitution with friction).",
)
COMPLIANT_SOURCE = (
    "Y. Gonthier, J. McPhee, C. Lange, J.-C. Piedboeuf, Multibody System Dynamics 11 (2004) 209 "
    "(compliant stops)."
)


def page(mechanism: Mechanism, variables: tuple[Variable, ...], experiment: Experiment) -> str:
    """Return the HTML page of the Python FMU of a mechanism."""
    return _page(
        mechanism,
        _summary(mechanism, "FMI 2.0 co-simulation"),
        _use(mechanism, experiment),
        equations(mechanism),
        _walls(mechanism),
        _variables(variables),
        _limits(mechanism, variables, INPUTS_OF_STEPS),
        _sources(mechanism),
        _licenses(),
    )


def native_page(
    mechanism: Mechanism,
    interface: NativeInterface,
    version: int,
    platforms: Sequence[str],
    experiment: Experiment,
    with_reference: bool,
    live: LivePart | None = None,
) -> str:
    """Return the HTML page of a native FMU.

    Parameters
    ----------
    mechanism : Mechanism
        The exported mechanism.
    interface : NativeInterface
        Its variables.
    version : {2, 3}
        Version of FMI.
    platforms : sequence of str
        Names of the platforms of the libraries inside.
    experiment : Experiment
        The default experiment.
    with_reference : bool
        Whether the FMU contains reference results of the default experiment.
    live : LivePart or None
        The part of the page that simulates the mechanism; None: the page is static.
    """
    variables = interface.variables
    return _page(
        mechanism,
        _summary(mechanism, f"FMI {version}.0 model exchange and co-simulation", live),
        _native_use(mechanism, interface, version, platforms, experiment, with_reference),
        equations(mechanism),
        _exchange(interface, version),
        _events(mechanism, interface, version),
        _walls(mechanism),
        _variables(variables),
        _limits(mechanism, variables, INPUTS_OF_BOTH),
        _sources(mechanism),
        _native_licenses(platforms, live is not None),
        live=live,
    )


def explorer_page(mechanism: Mechanism, variables: tuple[Variable, ...], live: LivePart) -> str:
    """Return the HTML page that simulates a mechanism without an FMU.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    variables : tuple of Variable
        The variables of its FMUs.
    live : LivePart
        The part of the page that simulates the mechanism.
    """
    return _page(
        mechanism,
        _summary(mechanism, "Simulation in the browser", live),
        equations(mechanism),
        _walls(mechanism),
        _variables(variables),
        _limits(mechanism, variables, INPUTS_OF_STEPS),
        _sources(mechanism),
        live=live,
    )


def _page(mechanism: Mechanism, *sections: str, live: LivePart | None = None) -> str:
    name, style = escape(mechanism.name), STYLE + (live.style if live else "")
    script = live.script if live else ""
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy(style, script)}">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{name}</title>\n<style>{style}</style>\n</head>\n<body>\n"
        + _focusable("\n".join(sections))
        + (f"\n{live.data}<script>{script}</script>" if live else "\n")
        + "\n</body>\n</html>\n"
    )


def _focusable(sections: str) -> str:
    """Let the keyboard scroll code, formulas and tables that are wider than the page."""
    for scrolled in ("<pre", '<div class="table"', '<math display="block"'):
        sections = sections.replace(f"{scrolled}>", f'{scrolled} tabindex="0">')
    return sections


def _list(title: str, items: Iterable[str], *, ordered: bool = False) -> str:
    tag = "ol" if ordered else "ul"
    lines = "\n".join(f"<li>{item}</li>" for item in items)
    return f"<h2>{title}</h2>\n<{tag}>\n{lines}\n</{tag}>"


def _sources(mechanism: Mechanism) -> str:
    more = [COMPLIANT_SOURCE] if COMPLIANT in laws_of(mechanism) else []
    return _list("Sources", map(escape, [*SOURCES, *more]), ordered=True)


def _flexures(mechanism: Mechanism) -> str:
    """Return a sentence for each kind of flexure models."""
    beams = {kind.model == BEAM for kind in mechanism.flexure_types}
    sentences = {
        False: "Flexures are replaced by rigid links and torsion springs (a pseudo-rigid-body "
        "model).",
        True: "Flexures are beams whose bending moment is a polynomial.",
    }
    return " ".join(sentences[beam] for beam in sorted(beams))


def _impacts(mechanism: Mechanism) -> str:
    """Return a sentence for each kind of stops."""
    sentences = {
        RIGID: "Impacts follow the laws of rigid bodies.",
        COMPLIANT: "Compliant stops are indented, and their contact force brakes and returns the "
        "body.",
    }
    return " ".join(sentences[law] for law in laws_of(mechanism))


def _summary(mechanism: Mechanism, flavour: str, live: LivePart | None = None) -> str:
    drawing = escape(mechanism.drawing.strip("\n"))
    figure = f"<figure><pre>{drawing}</pre></figure>" if drawing else ""
    return (
        f"<h1>{escape(mechanism.name)}</h1>\n"
        f"<p><strong>{escape(mechanism.title)}.</strong> "
        f"{escape(mechanism.description.strip())}</p>\n{live.markup if live else ''}\n{figure}\n"
        f"<p>{_flexures(mechanism)} {_impacts(mechanism)} Events are located to "
        "10<sup>-12</sup>&#160;s inside a communication step. Decaying bounces end in "
        "resting contact, which releases when the contact force reaches zero.</p>\n"
        f"<p>{flavour}, generated by {GENERATION_TOOL}.</p>"
    )


def _example(mechanism: Mechanism, experiment: Experiment, options: str = "") -> str:
    """Return a script that simulates an FMU with FMPy."""
    stops = [stop.name for stop in mechanism.stops]
    start = f'    start_values={{"{stops[0]}.restitution": 0.4}},\n' if stops else ""
    body = mechanism.release.body
    output = f'"{body}.x"' + "".join(f', "{stop}.impact_count"' for stop in stops)
    code = (
        "from fmpy import simulate_fmu\n\n"
        f'result = simulate_fmu(\n    "{mechanism.name}.fmu",\n'
        f"    stop_time={experiment.stop_time:g},\n"
        f"{start}    output=[{output}],\n{options})\n"
        "for name in result.dtype.names:\n    print(name, result[name][-1])"
    )
    return f"<pre><code>{escape(code)}</code></pre>\n"


def _use(mechanism: Mechanism, experiment: Experiment) -> str:
    return (
        f"<h2>Use</h2>\n{_example(mechanism, experiment)}"
        "<p>Requirements: <strong>Python 3.11 or later with NumPy and SciPy</strong> on the "
        "machine that runs the FMU; Linux or Windows on x86-64. Importers written in Python (FMPy, "
        "PyFMI) need nothing else. Other importers must find the Python library when they load "
        "the FMU (on Linux for instance with <code>LD_PRELOAD=libpython3.11.so</code>).</p>\n"
        f"<p>The folder <code>{FOLDER}</code> has the start values as a parameter set (SSV).</p>\n"
        "<p>Path: unpack the FMU to a folder whose path has only letters and digits of ASCII, "
        "spaces and <code>. _ - ~</code>. The library pythonfmu decodes no other percent-encoded "
        "characters and crashes the host. Set <code>TMPDIR</code> (Linux) or <code>TMP</code> "
        "(Windows) for FMPy, or use the native FMU, which reads all paths.</p>\n"
        "<p>Errors:</p>\n<ul>\n"
        "<li>An invalid value, parameter set or step is rejected. The reason is logged, and every "
        "<code>doStep</code> returns <code>fmi2Discard</code> until the value is corrected.</li>\n"
        "<li>A few errors need a <code>reset</code>, and their messages say so: setting an output, "
        "setting a value reference that is not in the model description, or a failure during the "
        "simulation.</li>\n"
        "<li>Getting a variable with the function of another type, or a value reference that is "
        "not in the model description, logs an error and returns NaN, 0 or false. The simulation "
        "continues.</li>\n"
        "<li>In these cases, and if a saved state is damaged, the call itself returns "
        "<code>fmi2OK</code>, and any GUID is accepted: pythonfmu permits no other status. The "
        "native FMU returns <code>fmi2Error</code>.</li>\n"
        "<li>FMPy ends the simulation early at <code>fmi2Discard</code>. The reasons of rejected "
        "steps are therefore also printed to the standard error stream.</li>\n"
        "<li>The wrapper forwards log messages, those of impacts included, only if the importer "
        "requests them (FMPy: <code>debug_logging=True</code>).</li>\n</ul>"
    )


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
    "Inputs are constant within a communication step. Outputs at a communication point do "
    "not depend on the inputs that are set there."
)
INPUTS_OF_BOTH = (
    "In co-simulation, inputs are constant within a communication step. In model exchange, "
    "the <code>displacement</code> of a wall is used as given, and its <code>velocity</code> "
    "should be the rate of the displacement."
)

IMPACT_LIMIT = "A rigid impact has an impulse, but no duration and no peak force."
STOP_LIMITS = (
    "An impact below <code>rest_speed</code> ends in resting contact if the body is "
    "pressed against the stop. Bouncing then ends earlier by at most "
    "2 eps v / (a (1 - eps)), with v the rest speed, eps the restitution and a the "
    "pressing acceleration.",
    "All impacts within one communication step are computed and counted; the latched outputs "
    "describe the last one.",
)

WALLS = (
    "In co-simulation the inputs of a wall at a communication point t0 define a line",
    formula("r(t) = position + displacement + v (t - t_0)"),
    "with v the input <code>velocity</code> or, until that has been non-zero, the mean rate of the "
    "<code>displacement</code>. The wall joins the line within T, twice the recent longest "
    "communication step (at most a fifth of the period). With e and u its distance and speed ahead "
    "of the line at t0, and s = (t - t0)/T &le; 1, its position is",
    formula("x(t) = r(t) + {(1 - s)}^2 (e + (2 e + u T) s)"),
)
WALL_RULES = (
    "A uniform motion that is given with its velocity is exact. Otherwise the error is below "
    "2 a h<sup>2</sup>, with a the acceleration of the true wall and h the longest step. After a "
    "jump of the displacement by d, the wall is never further than d from its target.",
    "A body rests on a moving wall while the contact force, which includes the wall's "
    "acceleration, is positive.",
    "In event mode, <code>velocity</code> acts at once. A jump below <code>rest_speed</code> "
    "leaves a closed stop closed; its impulse is part of <code>impulse_sum</code>.",
    "A wall that is part of another model has a <code>mobility</code>, its inverse effective mass. "
    "The impulse is that between two masses, and the wall changes its velocity by it. The other "
    "model must receive, in the direction in which the body approaches, the growth of "
    "<code>impulse_sum</code> at impacts and <code>force</code> while the stop holds; from a "
    "compliant stop, <code>force</code> only.",
)


def _walls(mechanism: Mechanism) -> str:
    """Return the section on moving walls, if the mechanism has stops."""
    if not mechanism.stops:
        return ""
    line, position = WALLS[1], WALLS[3]
    rules = "".join(f"<li>{rule}</li>" for rule in WALL_RULES)
    return (
        f"<h2>Moving walls</h2>\n<p>{WALLS[0]}</p>\n{line}\n<p>{WALLS[2]}</p>\n"
        f"{position}\n{_drawn_wall()}\n<ul>{rules}</ul>"
    )


def _drawn_wall() -> str:
    """Return a figure of a wall at rest that joins the line of new inputs."""
    wall, width, rise = Wall(0.4, 0.6, 0.0, -0.4, -0.6, 1.0), 200.0, 90.0

    def path(kind: str, points: Iterable[tuple[float, float]]) -> str:
        places = " ".join(f"{80 + width * t:.1f},{140 - rise * x:.1f}" for t, x in points)
        return f'<polyline points="{places}" fill="none" stroke="currentColor" {kind}/>'

    joining = [(k / 20, float(wall.motion(k / 20)[0])) for k in range(21)]
    drawn = [
        path('stroke-width="2.5"', [(-0.3, 0.0), *joining, (1.4, wall.reference(1.4))]),
        path('stroke-dasharray="5 4"', [(0.0, wall.reference(0.0)), (1.4, wall.reference(1.4))]),
        path('stroke-width="0.7"', [(0.0, -0.1), (0.0, 1.2)]),
        path('stroke-width="0.7"', [(1.0, -0.1), (1.0, 1.2)]),
    ]
    labels = ((96, 88, "line r"), (150, 135, "wall x"), (76, 165, "t0"), (262, 165, "t0 + T"))
    drawn += [
        f'<text x="{x}" y="{y}" font-size="13" fill="currentColor">{text}</text>'
        for x, y, text in labels
    ]
    return (
        '<figure><svg viewBox="0 0 380 170" width="380" role="img" '
        f'aria-label="A wall joins the line of its inputs">{"".join(drawn)}</svg></figure>'
    )


def _limits(mechanism: Mechanism, variables: tuple[Variable, ...], inputs: str) -> str:
    models = {kind.model for kind in mechanism.flexure_types}
    laws = laws_of(mechanism)
    impact = [IMPACT_LIMIT] if RIGID in laws else []
    planar = (
        "The motion is planar. Flexures are slender, of uniform section and of linear elastic "
        "material; they neither yield nor touch each other."
    )
    duration = (
        "The duration of a real impact (0.1 ms) is comparable to the period of the axial "
        "vibrations of the flexures (0.5 ms in the steel structure of source 1). This model has no "
        "axial vibrations, because its flexures do not stretch."
    )
    rigid = [
        " ".join([*impact, duration]),
        planar,
        "Flexures that do not stretch keep a body on parallel, straight flexures from turning, so "
        "that the place of a hit has no effect there. With flexures that stretch, a rigid impact "
        "off the centre of mass loses more energy of the fundamental mode. The loss of a real "
        "impact depends on the duration of the contact.",
    ]
    items = [*impact, planar] if stretches(mechanism) else rigid
    if not mechanism.flexures:
        items = [*impact, "The motion is planar, and bodies are rigid."]
    for name in sorted(models):
        if MODELS[name].coefficients:
            items.append(
                f"End moments: the tip slope of a {name} cantilever under an end moment is "
                f"{MODELS[name].end_slope:.3f} times the exact slope. Transverse end forces are "
                "modelled well."
            )
    if BEAM in models:
        items.append(
            "Beams: the bending moment is a polynomial along each flexure. Vibrations of a flexure "
            "with more waves than its polynomial are missing."
        )
    straight = "kilohertz" if stretches(mechanism) else "infinite stiffness"
    if "2R" in models:
        items.append(
            "Without damping, the motion of a guide on 2R flexures through its straight shape is "
            f"chaotic: two of its modes go from about a hundred hertz to {straight} there. A "
            "little stiffness-proportional damping removes the chaos, hence the default of "
            f"<code>damping.beta</code> ({_default('damping.beta', variables)} s). Without it, "
            "single impacts cannot be predicted after a few bounces."
        )
    if mechanism.stops:
        items += STOP_LIMITS if RIGID in laws else STOP_LIMITS[1:]
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


LOGGED = {
    2: "Errors are logged always, warnings and impacts if logging is on (FMPy: "
    "<code>debug_logging=True</code>).",
    3: "FMI 3.0 forbids all messages while logging is off: switch it on to see reasons (FMPy: "
    "<code>debug_logging=True</code>).",
}
"""When messages are logged, by the version of FMI."""


def _native_use(
    mechanism: Mechanism,
    interface: NativeInterface,
    version: int,
    platforms: Sequence[str],
    experiment: Experiment,
    with_reference: bool,
) -> str:
    reference = f" The folder <code>{FOLDER}</code> has the start values as a parameter set (SSV)"
    reference += (
        ", and reference results, computed by the Python engine: the default experiment, a smoke "
        "test, and a validation with the values before and after each impact. Its "
        "<code>README.txt</code> explains the comparison."
        if with_reference
        else "."
    )
    event_mode = "    use_event_mode=True,\n    early_return_allowed=True,\n"
    options = event_mode if interface.clocks else ""
    parts = [
        f"<h2>Use</h2>\n{_example(mechanism, experiment, options)}",
        "<p>Requirements: <strong>none</strong> except the C library of the platform. Libraries "
        f"inside: {', '.join(platforms)}. For other platforms, and for targets without a file "
        "system, the FMU contains the C source with the mechanism as a constant array "
        f"(<code>fmpy compile {mechanism.name}.fmu</code>).</p>\n"
        "<p>The compiled library is the same for every mechanism. At instantiation it reads the "
        "mechanism from <code>resources/mechanism.bin</code> and checks it against the token of "
        f"this FMU.{reference}</p>",
        f"<p>The default experiment has a communication step of {experiment.step:g}&#160;s and "
        f"the tolerance {_default('solver.tolerance', interface.variables)}.</p>",
        "<p>Model exchange in FMPy: <code>fmi_type=&quot;ModelExchange&quot;, output_interval="
        f"{experiment.step:g}</code> or less. Its solver CVode takes at most 500 steps from one "
        "output to the next; if it needs more, an error says <code>mxstep steps taken</code>. The "
        "steps of "
        "the importer's solver should be short compared with the time between two bounces: in a "
        "longer step, a contact that begins and ends within the step may be missed. Solvers "
        "with a fixed step need one that is stable for the fastest vibration of the flexures.</p>",
        "<p>An invalid value, call or step is rejected: the reason is logged and the instance does "
        "not change. Steps are rejected until an invalid value is corrected, or, after a variable "
        f"was set that cannot be set, until a reset. {LOGGED[version]} The state of an instance "
        "can be saved, serialized and restored bit for bit. Instances are independent of each "
        "other; each may be used by one thread at a time.</p>",
    ]
    if version == 3 and not interface.clocks:
        parts.append(
            "<p>Event mode is optional: with <code>use_event_mode=True</code> and "
            "<code>early_return_allowed=True</code>, FMPy records the values before and after "
            "each impact.</p>"
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
        "<p>The coordinates q of the mechanism satisfy the loop constraints "
        f"{inline('Phi(q) = 0')}. The states "
        "are the independent coordinates "
        f"{inline('q_i')}, one per degree of freedom, and their rates {inline('v_i')}. "
        "The dependent coordinates "
        f"{inline('q_d')} "
        "are computed from the constraints at every call, so that "
        "the solver of the importer needs no treatment of constraints:</p>\n"
        f"{formula('Phi(q_i, q_d) = 0', 'v_d = -{Phi_{q_d}}^{-1} Phi_{q_i} v_i')}\n"
        '<div class="table"><table><caption>Continuous states, in order</caption><thead><tr>'
        "<th>state</th><th>derivative</th></tr></thead><tbody>"
        f"{rows}</tbody></table></div>\n"
        "<p>The independent coordinates were chosen at the export. The choice keeps "
        f"{inline('Phi_{q_d}')} as "
        "far from singular as possible between the straight shape and the release shape of the "
        "mechanism file; start values do not change it. Far outside these shapes "
        f"{inline('Phi_{q_d}')} can "
        "become singular. Then the derivatives cannot be computed, the reason is logged, and the "
        f"call returns <code>{discard}</code>. Co-simulation has no such singularity, because it "
        "integrates all coordinates and projects them onto the constraints.</p>\n"
        "<p>Directional derivatives of outputs and of state derivatives with respect to states and "
        "inputs are exact. A stop that holds is a constraint on accelerations. If its gap has "
        f"drifted after an integrator step, <code>fmi{version}CompletedIntegratorStep</code> "
        "requests event mode, in which the drift is removed. Any state may change at an event.</p>"
    )


def _peaks(mechanism: Mechanism) -> Iterator[str]:
    if any(stop.compliant for stop in mechanism.stops):
        yield (
            "<p>Each extremum of the force of a compliant stop is a state event (release "
            "indicator): its peak and duration do not depend on the importer's steps.</p>"
        )
    if stressed(mechanism):
        yield (
            "<p>In model exchange, steps sample <code>peak_stress</code>. For an error of 0.1 % "
            "they must be at most 1/20 of the period of the fastest vibration of the stress.</p>"
        )


_EVENT_LOOP = """\
<p>After a step that needs event handling, a master</p>
<ol>
<li>calls <code>fmi3EnterEventMode</code>;</li>
<li>sets the inputs of walls and forces that jump at this time;</li>
<li>calls <code>fmi3UpdateDiscreteStates</code> until no other update is needed;</li>
<li>gets <code>impulse_sum</code> and gives its growth to the model of the wall;</li>
<li>sets the new <code>velocity</code> of the wall, and returns by <code>fmi3EnterStepMode</code>.
</li>
</ol>"""


def _events(mechanism: Mechanism, interface: NativeInterface, version: int) -> str:
    if not (mechanism.stops or mechanism.rubbing):
        return "<h2>Events</h2>\n<p>This mechanism has no events.</p>"
    parts = [
        "<h2>Events</h2>\n<p>Events are: the closing of a stop (an impact, or the capture into "
        "rest), the release of a stop that holds, the beginning and the end of sliding with "
        "friction, and, while a guide slides, the change of the side to which it pushes. Each has "
        "an event indicator, which changes its sign at the event. Indicators are scaled to the "
        "order of 1 and are never 0 after an event.</p>",
        *_peaks(mechanism),
        "<p>At an event, values are those <em>before</em> the event until it has been handled; in "
        "model exchange, that is the update of the discrete states in event mode. In "
        "co-simulation without event mode, impacts happen inside a step. The latched outputs "
        "describe the last impact; <code>impact_count</code> counts all.</p>",
    ]
    if version == 3:
        parts.append(
            "<p>In co-simulation with event mode, a step returns early at the time of the event if "
            "the importer allows early return; the velocities change in "
            "<code>fmi3UpdateDiscreteStates</code>. If the importer does not allow early return, "
            "impacts happen inside the step.</p>"
        )
        parts.append(_EVENT_LOOP)
    if interface.clocks:
        names = ", ".join(f"<code>{escape(name)}</code>" for name in interface.clocks)
        parts.append(
            f"<p>Output clocks, which tick in event mode at each impact: {names}. An importer of "
            "this FMU must support event mode; an FMU without clocks does not require it.</p>"
        )
    return "\n".join(parts)


def _native_licenses(platforms: Sequence[str], live: bool) -> str:
    windows = (
        ' The libraries for Windows contain start-up code of MinGW-w64, see <a href="licenses/'
        'mingw-w64.txt">licenses/mingw-w64.txt</a>.'
        if any(name.endswith("-windows") for name in platforms)
        else ""
    )
    module = (
        " The simulation on this page contains parts of wasi-libc and musl: MIT, see "
        '<a href="licenses/wasi-libc.txt">licenses/wasi-libc.txt</a>.'
        if live
        else ""
    )
    return (
        "<h2>Licences</h2>\n<p>The model and its engine: MIT, see "
        '<a href="licenses/prbm-impact.txt">licenses/prbm-impact.txt</a>. Libraries that '
        "were compiled with ziglang contain parts of its runtime library: MIT, see "
        f'<a href="licenses/zig.txt">licenses/zig.txt</a>.{windows}{module}</p>'
    )
