"""Execute the notebooks of this folder and store their outputs.

    python examples/notebooks/execute.py

It needs the packages nbclient and ipykernel.
"""

import sys
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent


def executed(path: Path) -> Any:
    """Return a notebook with the outputs of its cells.

    Raises
    ------
    CellExecutionError
        If a cell fails.
    """
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.read(path, as_version=4)
    NotebookClient(notebook, timeout=600, kernel_name="python3").execute()
    for cell in notebook.cells:
        cell.metadata.clear()
    notebook.metadata.get("language_info", {}).clear()
    notebook.metadata["language_info"] = {"name": "python"}
    return notebook


def main() -> None:
    """Execute all notebooks, or those that are named."""
    import nbformat

    names = sys.argv[1:] or [path.name for path in sorted(FOLDER.glob("*.ipynb"))]
    for name in names:
        notebook = executed(FOLDER / name)
        nbformat.write(notebook, FOLDER / name)
        print(name)


if __name__ == "__main__":
    main()
