"""The page of the counterparts in both engines is that of the present code."""

import runpy
from types import SimpleNamespace

from support import ROOT

counterparts = SimpleNamespace(**runpy.run_path(str(ROOT / "docs" / "write_counterparts.py")))


def test_the_page_is_up_to_date():
    written = counterparts.PAGE.read_text(encoding="utf-8")
    assert written == counterparts.page(), "run python docs/write_counterparts.py"


def test_every_module_has_a_c_file_or_a_reason():
    modules = counterparts.modules()
    assert {one.name for one in modules if not one.files} == counterparts.PYTHON_ONLY.keys()
    for name, files in counterparts.MORE.items():
        assert name in {one.name for one in modules}
        assert set(files) <= set(counterparts.files_of_c())


def test_every_c_file_has_a_module_or_a_reason():
    known = {file for one in counterparts.modules() for file in one.files}
    assert known.isdisjoint(counterparts.C_ONLY)
    assert known | counterparts.C_ONLY.keys() == set(counterparts.files_of_c())
