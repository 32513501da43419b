r"""A mechanism of finite elements, as an independent reference for pseudo-rigid-body models.

The elements are built from the same mechanism file.  Every flexure becomes a line of planar cable
elements (absolute nodal coordinates, bending and stretching, large rotations) of Exudyn [1]_.
Constraints clamp or pin the cables to rigid bodies with mass, inertia and points off the centre of
mass.  A ``free`` end, at which the last link of a pseudo-rigid-body model carries the body, is a
clamp here.  Exudyn evaluates forces, stiffness, mass, constraints and their Jacobian, and
integrates.  Statics and modes are solved here:

    f(q) + C mu + r F = 0,    Phi(q) = 0,
    (K - d(C mu)/dq) phi = omega^2 M phi,    C^T phi = 0,

with q the displacements of the nodes from the straight shape, f elastic forces and loads,
K = -df/dq, C the transposed Jacobian of the constraints Phi, and r F the holding force.

Modules: ``model`` builds the elements, ``equations`` evaluates them, ``statics`` solves for shapes
and modes, ``elements`` has the class :class:`FiniteElements`, ``transient`` integrates,
``hit`` simulates one hit on a compliant stop.

Accuracy and limits
-------------------
* Shapes and modes converge with the number of elements.  For the steel guide at rest, results with
  16 elements per flexure are within 2e-5 of those with 32 in the displacement and the fundamental
  frequency, and within 2e-4 in the next two frequencies.
* The sections are thin: no shear, no rotary inertia, no anticlastic curvature.
* An impact is the same instantaneous event as in the engine: Newton's law, with the masses of the
  elements.  Only the mass that is clamped to the body stops with it at once; waves run along the
  flexures afterwards.  The modal restitution and the motion up to the next impacts converge.  The
  motion after many impacts is sensitive to all parameters, as in reality.  Only a hit on a
  compliant stop has a peak force and a duration.
* The steps must resolve the motion of interest: the impact times of the steel guide change by
  1e-5 s between steps of 1e-4 s and 1e-5 s.  A step that gains energy is repeated with shorter
  steps.
* The waves after an impact can grow slowly, with an energy gain per step below the detected limit,
  until the results are wrong: compare runs with two step sizes.  ``spectral_radius`` 0.5 (the
  default) is more robust than 0.9, without loss of accuracy in the slow motion.
* Resting contact is for soft captures.  With a ``rest_speed`` close to the impact speeds, the waves
  in the flexures pull the body off the wall and push it back repeatedly.

Sources
-------
.. [1] J. Gerstmayr, Exudyn - a C++-based Python package for flexible multibody systems,
   Multibody Syst. Dyn. 60 (2024) 533.
.. [2] J. Gerstmayr, H. Irschik, J. Sound Vib. 318 (2008) 461 (the cable element).
"""

from .elements import FiniteElements
from .model import FiniteElementError
from .statics import Shape

__all__ = ["FiniteElementError", "FiniteElements", "Shape"]
