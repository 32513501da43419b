"""The kernel's declarations of FMI agree with the headers of the standards."""

import re
import shutil
import subprocess

import pytest

from c_importer import FLAGS, HEADERS, KERNEL

pytestmark = [
    pytest.mark.native,
    pytest.mark.skipif(shutil.which("cc") is None, reason="needs the command cc"),
]


@pytest.mark.parametrize("version", [2, 3])
def test_functions_have_the_types_of_the_standard_headers(version, tmp_path):
    """The compiler compares each definition with the prototype of the standard."""
    (tmp_path / "unit.c").write_text(
        f"#define PRBM_TYPES{version}_H\n"
        f"#define FMI{version}(name) fmi{version}##name\n"
        f"#define FMI{version}_TYPES_PLATFORM fmi2TypesPlatform\n"
        f"#define FMI{version}_VERSION fmi{version}Version\n"
        f"#define PRBM_FMI {version}\n"
        '#include "fmi/exported.h"\n'
        f'#include "fmi{version}Functions.h"\n'
        '#include "prbm_fmu.c"\n',
        encoding="utf-8",
    )
    command = ["cc", *FLAGS, "-fsyntax-only", "unit.c"]
    subprocess.run(command, cwd=tmp_path, check=True)


@pytest.mark.parametrize("version", [2, 3])
def test_types_and_constants_have_the_values_of_the_standard_headers(version, tmp_path):
    types, constants = declared(version)
    assert len(types) > 10
    assert len(constants) > 10
    lines = [f'printf("{name} %d\\n", (int)sizeof({name}));' for name in types]
    lines += [f'printf("{name} %d\\n", (int){name});' for name in constants]
    body = "\n".join(lines)
    printed = []
    for header in (f"fmi/types{version}.h", f"fmi{version}Functions.h"):
        source, program = tmp_path / "print.c", tmp_path / "print"
        source.write_text(
            f'#include <stdio.h>\n#include "{header}"\nint main(void) {{\n{body}\nreturn 0;\n}}\n',
            encoding="utf-8",
        )
        subprocess.run(["cc", f"-I{KERNEL}", f"-I{HEADERS}", "-o", program, source], check=True)
        printed.append(subprocess.check_output([program], text=True).splitlines())
    assert printed[0] == printed[1]


def declared(version: int) -> tuple[list[str], list[str]]:
    """Return the names of all types, and of all constants, that the kernel declares."""
    text = (KERNEL / "fmi" / f"types{version}.h").read_text(encoding="utf-8")
    found = re.findall(rf"\bfmi{version}\w+", text)
    names = sorted(set(found))
    constants = set(
        re.findall(rf"fmi{version}\w+", " ".join(re.findall(r"enum\s*{([^}]*)}", text)))
    )
    return [name for name in names if name not in constants], sorted(constants)
