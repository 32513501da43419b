"""Files inside an FMU that help to use it, in the folder of the layered standard FMI-LS-REF.

The manifest of the standard lists each file with its role.  The standard is for FMI 2.0 and 3.0.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from .description import serialized

FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
NAMESPACE = "http://fmi-standard.org/fmi-ls-manifest"
ATTRIBUTES = {
    "fmi-ls-name": "org.fmi-standard.fmi-ls-ref",
    "fmi-ls-version": "1.0.0-alpha.1",
    "fmi-ls-description": "Layered Standard providing information on related files included in "
    "an FMU.",
}


@dataclass(frozen=True)
class Related:
    """A file: its name, content and MIME type, its role in the standard, and a description."""

    file: str
    content: bytes
    type: str
    role: str
    description: str


def related_files(related: Iterable[Related]) -> dict[str, bytes]:
    """Return files and their manifest by path in the FMU."""
    related = list(related)
    ElementTree.register_namespace("fmi-ls", NAMESPACE)
    attributes = {f"{{{NAMESPACE}}}{name}": value for name, value in ATTRIBUTES.items()}
    root = Element("fmiReferences", attributes)
    for one in related:
        named = {"type": one.type, "source": one.file, "role": one.role}
        SubElement(root, "Related", named | {"description": one.description})
    files = {f"{FOLDER}/{one.file}": one.content for one in related}
    return files | {f"{FOLDER}/fmi-ls-manifest.xml": serialized(root)}
