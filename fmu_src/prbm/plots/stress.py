"""Pictures of the stress in held shapes."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from ..base.unit_text import length_unit
from ..drawing.shapes import Shapes, corners
from ..drawing.style import own_style
from ..mechanics.assembly import assemble
from ..mechanics.sections import static_section_loads
from ..mechanics.statics import equilibrium
from ..mechanics.stress import faces
from ..mechanism.description import Mechanism
from .figures import WIDTH
from .picture import Drawing
from .stress_colours import directions_of, drawn_line, norm, set_stress, stress_bar, stress_line

PANEL_MIN, PANEL_MAX = 1.6, 4.5  # Heights of the picture of a shape [inch].


@own_style()
def stress_figure(
    mechanism: Mechanism, values: Mapping[str, float], held: Sequence[float], labels: Sequence[str]
) -> Figure:
    """Return a picture of the stress in held shapes.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    values : mapping
        Parameters that differ from their defaults.
    held : sequence of float
        Displacements [m] or rotations [rad] at which the released body is held.
    labels : sequence of str
        A title for each of them.

    Raises
    ------
    EquilibriumError
        If there is no equilibrium.
    """
    system = assemble(mechanism, mechanism.values(values))
    shapes = Shapes(system)
    found = [equilibrium(system, x) for x in held]
    loads = [static_section_loads(system, shape) for shape in found]
    stress = [{one.name: np.stack(faces(one)) for one in part} for part in loads]
    colours = norm(max(float(np.abs(x).max()) for part in stress for x in part.values()))
    every = np.concatenate(
        [corners(line.outline, shapes.arms(shape.q)) for shape in found for line in shapes.flexures]
        + [shapes.body(name, shapes.straight) for name in shapes.bodies]
    )
    aspect = float(np.ptp(every.imag) / np.ptp(every.real))
    height = min(max(aspect * 0.8 * WIDTH, PANEL_MIN), PANEL_MAX)
    figure = Figure((WIDTH, 0.6 + len(held) * (height + 0.3)), dpi=120, layout="constrained")
    grid = figure.add_gridspec(len(held), 2, width_ratios=(1.0, 0.025))
    forwards = directions_of(shapes)
    for k, (shape, part, label) in enumerate(zip(found, loads, labels, strict=True)):
        axes = figure.add_subplot(grid[k, 0])
        drawing, E = Drawing(axes, shapes), shapes.arms(shape.q)
        drawing.ghost(shapes.straight)
        drawing.shape(E)
        positions = {one.name: one.position for one in part}
        for line in shapes.flexures:
            name = line.flexure.name
            coloured = stress_line(colours, zorder=2.2)
            z = drawn_line(line, E, forwards[name])
            set_stress(coloured, z, positions[name], stress[k][name], drawing.factor)
            axes.add_collection(coloured)
        axes.set_title(label, fontsize=9, loc="left")
        axes.set_ylabel(f"y [{length_unit(shapes.size)[1]}]", fontsize=8)
        axes.tick_params(labelsize=8)
    axes.set_xlabel(f"x [{length_unit(shapes.size)[1]}]", fontsize=8)
    stress_bar(figure, figure.add_subplot(grid[:, 1]), colours)
    figure.suptitle(mechanism.title, fontsize=11, x=0.02, ha="left")
    return figure
