"""The parallel guide as finite elements (ANCF cables) in Exudyn: a model without rigid links."""

import warnings
from dataclasses import dataclass

import numpy as np
import pytest


@dataclass(frozen=True)
class ElementGuide:
    """Static deflection and frequencies of the guide by finite elements.

    Parameters
    ----------
    rest : complex
        Displacement of the shuttle's centre of mass under gravity [m].
    frequency : (k,)
        Frequencies of small vibrations about that position [Hz], ascending.
    """

    rest: complex
    frequency: np.ndarray


def guide(values, elements: int) -> ElementGuide:
    """Return rest position and frequencies of the guide; ``elements`` is their number per flexure.

    The cable elements bend and stretch and are clamped to the ground and to the shuttle.  Their
    sections have no rotary inertia.
    """
    exu = pytest.importorskip("exudyn", reason="Exudyn, which has the finite elements, is missing")
    from exudyn import itemInterface as item
    from exudyn.beams import GenerateBeamElementsAlongLine

    L, h, b, E, rho = (
        values[f"flexure.{name}"]
        for name in ("length", "thickness", "width", "youngs_modulus", "density")
    )
    W, height = values["shuttle.width"], values["shuttle.com_height"]
    gravity = [values["gravity.x"], values["gravity.y"], 0.0]
    mbs = exu.SystemContainer().AddSystem()
    mbs.AddObject(item.ObjectGround())
    node = mbs.AddNode(item.NodeRigidBody2D(referenceCoordinates=[W / 2, L + height, 0]))
    shuttle = mbs.AddObject(
        item.ObjectRigidBody2D(
            mass=values["shuttle.mass"], inertia=values["shuttle.inertia"], nodeNumber=node
        )
    )
    centre = mbs.AddMarker(item.MarkerBodyPosition(bodyNumber=shuttle))
    weight = [values["shuttle.mass"] * g for g in gravity]
    mbs.AddLoad(item.Force(markerNumber=centre, loadVector=weight))
    cable = item.ObjectANCFCable2D(
        massPerLength=rho * b * h, bendingStiffness=E * b * h**3 / 12, axialStiffness=E * b * h
    )
    # The x axis of a cable is along it: its frame is that of the shuttle, turned by 90 degrees.
    upright = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    for x in (0.0, W):
        line = GenerateBeamElementsAlongLine(
            mbs, [x, 0, 0], [x, L, 0], elements, cable, gravity=gravity,
            groundConstraintsStart=[True] * 4,
        )  # fmt: skip
        top = item.MarkerBodyRigid(
            bodyNumber=line["elements"][-1], localPosition=[L / elements, 0, 0]
        )
        place = exu.HT(rotation=upright, translation=[x - W / 2, -height, 0])
        clamp = item.MarkerBodyRigid(bodyNumber=shuttle, localHT=place)
        pair = [mbs.AddMarker(top), mbs.AddMarker(clamp)]
        mbs.AddObject(item.GenericJoint(markerNumbers=pair, constrainedAxes=[1, 1, 0, 0, 0, 1]))
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.staticSolver.numberOfLoadSteps = 10
    settings.staticSolver.newton.relativeTolerance = 1e-9
    settings.staticSolver.newton.absoluteTolerance = 1e-12
    settings.staticSolver.verboseMode = 0
    settings.solution.file.write = False
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    if any(gravity):  # Without a load the static solver has no scale for its relative tolerance.
        mbs.SolveStatic(settings, updateInitialValues=True)
    x, y, _ = mbs.GetNodeOutput(node, exu.OutputVariableType.Displacement)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Exudyn's call of SciPy warns.
        f, _ = mbs.ComputeODE2Eigenvalues(
            settings, useSparseSolver=False, numberOfEigenvalues=6, convert2Frequencies=True,
            useAbsoluteValues=False,
        )  # fmt: skip
    return ElementGuide(complex(x, y), np.sort(f))
