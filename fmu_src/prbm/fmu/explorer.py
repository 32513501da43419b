"""The page that simulates a mechanism in the browser, without an FMU."""

import logging
from collections.abc import Mapping

from ..kernel.compiler import browser_module
from ..mechanism.description import Mechanism
from .documentation import explorer_page
from .export import Export
from .native_fmu import described, simulated_part

log = logging.getLogger(__name__)


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
    export = Export(mechanism, changes)
    native = described(export, 3)
    simulated = simulated_part(export, browser_module(log.warning))
    return explorer_page(mechanism, native.variables, simulated)
