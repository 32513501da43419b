"""The page that simulates a mechanism in the browser, without an FMU."""

from collections.abc import Mapping

from ..interface.tables import tables
from ..kernel.compiler import browser_module
from ..mechanism.description import Mechanism
from ..runs.experiment import experiment
from .documentation import explorer_page
from .live.content import content
from .live.page import live_part
from .native_fmu import described


def explorer(mechanism: Mechanism, changes: Mapping[str, float] | None = None) -> str:
    """Return an HTML page that simulates a mechanism, as the page of a native FMU does.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    changes : mapping
        Start values of parameters and inputs that replace those of the mechanism.

    Raises
    ------
    PrbmError
        If the mechanism cannot start with these values, or there is no WebAssembly module and no
        compiler for it.
    """
    changes = dict(changes or {})
    native = described(mechanism, changes, 3)
    default = experiment(mechanism, changes)
    table = tables(mechanism, native.variables, "", native.independent, default.step)
    described_by = content(mechanism, native.variables, native.independent, default)
    return explorer_page(
        mechanism, native.variables, live_part(described_by, table, browser_module())
    )
