"""What the FMUs of a mechanism have in common."""

from unittest.mock import patch

import pytest

from prbm.fmu import native_fmu, python_fmu
from prbm.fmu.export import Export
from support import mechanism

CHANGES = {"stop.restitution": 0.5}


@pytest.mark.slow
def test_fmus_that_share_an_export_are_those_built_alone():
    """No FMU depends on the ones before it."""
    guide = mechanism("PRBDM")
    export = Export(guide, CHANGES)
    with patch.object(native_fmu, "reference", lambda *_: ()):
        for fmi in (3, 2):
            alone = native_fmu.build(guide, CHANGES, fmi)
            assert native_fmu.build_export(export, fmi) == alone
    assert python_fmu.build_export(export) == python_fmu.build(guide, CHANGES)
    assert export.changes == CHANGES
