"""What all contacts of a mechanism share at one position."""

from functools import cached_property

import numpy as np

from ..base.tolerances import DEPENDENT_FRICTION_RTOL
from . import contact
from .arrays import Complex, Real
from .system import System


class ContactProblem:
    """Directions, mass matrix and Jacobians at a position.

    Each is computed when it is needed first, however many contacts, trials and impulses need it.

    Parameters
    ----------
    system : System
        The assembled mechanism.
    q : (n,)
        Coordinates [rad].
    """

    def __init__(self, system: System, q: Real) -> None:
        self.system = system
        self.q = q.copy()

    @cached_property
    def e(self) -> Complex:
        """Directions, (d,)."""
        return self.system.directions(self.q)

    @cached_property
    def M(self) -> Real:
        """Mass matrix, (n, n) [kg m^2]."""
        return self.system.mass_matrix(self.e)

    @cached_property
    def gaps(self) -> Real:
        """Jacobian of the gaps of all stops, (s, n) [m/rad]."""
        return self.system.gap_rows.jacobian(self.e)

    @cached_property
    def slides(self) -> Real:
        """Jacobian of the displacements along the walls of all stops, (s, n) [m/rad]."""
        return self.system.slide_rows.jacobian(self.e)

    @cached_property
    def loops(self) -> Real:
        """Jacobian of the loops, (r, n) [m/rad]."""
        return self.system.loop_rows.jacobian(self.e)

    def is_at(self, system: System, q: Real) -> bool:
        """Return whether the problem is that of the system at the coordinates q."""
        return self.system is system and np.array_equal(self.q, q)

    def response(self, rows: Real) -> Real:
        """Return the changes of velocity by unit impulses along rows (k, n), (n, k).

        Raises
        ------
        SimulationError
            As :func:`prbm.mechanics.constraints.solve`.
        """
        return self.response_beside(self.loops, rows)

    def response_beside(self, held: Real, rows: Real) -> Real:
        """Return the response while the rates of ``held`` (r, n), loops among them, are zero."""
        return contact.response(self.M, held, rows, self.system.length)

    def inverse_mass(self, rows: Real, X: Real) -> Real:
        """Return the inverse mass in contact space of rows (k, n) with a response X, (k, k)."""
        return contact.contact_mobility(self.M, rows, X, self.system.length)

    def mobility(self, row: Real) -> float:
        """Return the inverse mass along a row (1, n) [1/kg]."""
        return float((row @ self.response(row)).item())

    def moves(self, row: Real) -> bool:
        """Return whether a motion along a row (1, n) is possible: its mobility is not round-off."""
        least = contact.least_mobilities(self.M, row, self.system.length)
        return self.mobility(row) > least.item()

    def independent(self, held: Real, row: Real) -> bool:
        """Return whether a motion along a row (1, n) is possible while ``held`` (r, n) rest.

        It is not if the row is round-off, or the constraints leave hardly any of its mobility.
        """
        if not self.moves(row):
            return False
        left = float((row @ self.response_beside(held, row)).item())
        return left > DEPENDENT_FRICTION_RTOL * self.mobility(row)
