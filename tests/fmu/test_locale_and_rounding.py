"""Native FMUs in a process with another decimal separator or another mode of rounding."""

import ctypes
import locale
import platform
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from native_host import ERROR, Instance

GERMAN = "de_DE.UTF-8"
TOWARDS_ZERO = {"x86_64": 0xC00, "aarch64": 0xC00000}
"""FE_TOWARDZERO of the C library by machine."""

linux = sys.platform == "linux" and platform.machine() in TOWARDS_ZERO
pytestmark = [pytest.mark.fmu, pytest.mark.native]
versions = pytest.mark.parametrize("fmi", [2, 3])


@pytest.fixture
def german(tmp_path, monkeypatch):
    """Set the decimal separator of the process to a comma within a test."""
    source = Path("/usr/share/i18n/locales/de_DE")
    if not (shutil.which("localedef") and source.exists()):
        pytest.skip("needs localedef and the source of the locale de_DE")
    target = tmp_path / "locales" / GERMAN
    target.parent.mkdir()
    subprocess.run(["localedef", "-i", "de_DE", "-f", "UTF-8", str(target)], check=True)
    monkeypatch.setenv("LOCPATH", str(target.parent))

    def switch():
        locale.setlocale(locale.LC_NUMERIC, GERMAN)
        assert locale.localeconv()["decimal_point"] == ","

    before = locale.setlocale(locale.LC_NUMERIC)
    yield switch
    locale.setlocale(locale.LC_NUMERIC, before)


def motion_and_message(fmu):
    """Return the values after 0.1 s, and the message about a wrong length."""
    with Instance(fmu) as moved, Instance(fmu) as wrong:
        moved.initialize().advance(0.1)
        wrong.set({"flexure.length": -0.04})
        wrong.enter()
        assert wrong.call("ExitInitializationMode") == ERROR
        return moved.bytes(), next(m for m in wrong.messages if "flexure.length" in m)


@pytest.mark.slow
@versions
def test_the_locale_changes_the_separator_of_messages_only(native, german, fmi):
    motion, message = motion_and_message(native["PRBDM", fmi])
    assert "flexure.length = -0.04 m" in message
    german()
    found, translated = motion_and_message(native["PRBDM", fmi])
    assert found == motion
    assert re.sub(r"(?<=\d),(?=\d)", ".", translated) == message


@pytest.mark.skipif(not linux, reason="needs the modes of rounding of the C library")
@versions
def test_rounding_towards_zero_is_refused_at_the_start_and_corrected(native, fmi):
    """With the mode of every process, the same instance then moves as without the attempt."""
    library = ctypes.CDLL("libm.so.6")
    with Instance(native["PRBDM", fmi]) as plain:
        plain.initialize().advance(0.1)
        expected = plain.bytes()
    with Instance(native["PRBDM", fmi]) as instance:
        instance.enter()
        library.fesetround(TOWARDS_ZERO[platform.machine()])
        try:
            found = instance.call("ExitInitializationMode")
        finally:
            library.fesetround(0)
        assert found == ERROR
        assert instance.messages
        instance.reset()
        instance.enter().begin()
        instance.advance(0.1)
        assert instance.bytes() == expected
