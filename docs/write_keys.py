"""Write the tables of keys of ``docs/mechanism-files.md`` from the schema of mechanism files.

    python docs/write_keys.py

A test compares the page with the schema.
"""

import copy
import json
import re
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "fmu_src"))

from prbm.files.mechanism_file import schema  # noqa: E402

PAGE = ROOT / "docs" / "mechanism-files.md"
Table = dict[str, Any]


def tables() -> dict[str, Table]:
    """Return the tables of a mechanism file by key."""
    root = schema()
    found = {"mechanism": root, "repeat": root["definitions"]["RepeatTable"]}
    for key, entry in root["properties"].items():
        reference = re.search(r"#/definitions/(\w+)", json.dumps(entry))
        if reference:
            found[key] = copy.copy(root["definitions"][reference[1]])
    return found


def keys_of(table: Table) -> str:
    """Return the keys of a table of the schema as a table of Markdown."""
    rows = ["| key | unit | default | range | meaning |", "|---|---|---|---|---|"]
    for key, entry in table["properties"].items():
        meaning, _, unit = entry["description"].partition(" [")
        cells = (f"`{key}`", unit.rstrip("]"), default(table, key), span(entry), meaning)
        rows.append("| " + " | ".join(cells).replace("|  |", "| |") + " |")
    return "\n".join(row.replace("|  |", "| |").replace("|  |", "| |") for row in rows)


def default(table: Table, key: str) -> str:
    """Return the default of a key as the page shows it."""
    if key in table.get("required", ()):
        return "required"
    value = table["properties"][key].get("default", "")
    return "" if value in ("", [], {}) else f"`{json.dumps(value)}`"


def span(entry: Table) -> str:
    """Return the bounds or the choices of a key."""
    choices = [entry, *entry.get("anyOf", ()), *entry.get("oneOf", ())]
    for choice in choices:
        if "enum" in choice:
            return ", ".join(f"`{value}`" for value in choice["enum"])
        if "minimum" in choice:
            return f"{choice['minimum']:g} to {choice['maximum']:g}"
    items = entry.get("items", {})
    return span(items) if items else ""


def page(text: str) -> str:
    """Return the text of the page with the tables of the schema.

    Raises
    ------
    SystemExit
        If the page has no place for a table.
    """
    for key, table in tables().items():
        block = f"<!-- keys of {key} -->\n{keys_of(table)}\n<!-- end -->\n"
        place = rf"<!-- keys of {key} -->\n.*?<!-- end -->\n"
        text, count = re.subn(place, lambda _, new=block: new, text, flags=re.DOTALL)
        if count != 1:
            raise SystemExit(
                f"{PAGE.name} needs one place for the keys of {key}: write\n\n"
                f"<!-- keys of {key} -->\n<!-- end -->"
            )
    return text


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text("utf-8")), encoding="utf-8")
    print(f"wrote {PAGE.relative_to(ROOT)}")
