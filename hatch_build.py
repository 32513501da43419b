"""Build hook: compiled libraries of the kernel, as a part of the wheel.

The environment variable ``PRBM_LIBRARIES`` selects them: ``host``, those of this machine, if it has
a C compiler (the default); ``all``, those of every platform and of web pages, for which the build
installs ``ziglang``; ``none``.

Metadata hook: the readme of the package, whose links to files of the repository become absolute if
the environment variable ``PRBM_REPOSITORY`` (or those of GitHub Actions) has its address, and texts
without a link otherwise.
"""

import os
import re
import shutil
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version as installed_version
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface
from packaging.tags import platform_tags

SELECTIONS = ("host", "all", "none")
LINK = re.compile(r"(!?)\[([^\]]*)\]\((?!https?:|mailto:)([^)\s]+)\)")  # To a file or heading.


def selection() -> str:
    """Return the selected libraries."""
    chosen = os.environ.get("PRBM_LIBRARIES", "").strip() or SELECTIONS[0]
    if chosen not in SELECTIONS:
        raise ValueError(f"PRBM_LIBRARIES = {chosen!r} must be one of {', '.join(SELECTIONS)}")
    return chosen


class LibrariesHook(BuildHookInterface):  # type: ignore[type-arg]
    """Compile libraries of the kernel, and add them to a wheel."""

    def dependencies(self) -> list[str]:
        """Return the packages that the build needs."""
        return ["ziglang>=0.15"] if selection() == "all" else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile the libraries, unless an editable installation is built."""
        if version == "editable" or selection() == "none":
            return
        sys.path.insert(0, str(Path(self.root) / "fmu_src"))
        from prbm.kernel.prebuilt import package_files
        from prbm.kernel.sources import kernel

        every = selection() == "all"
        made = all_libraries(self.app.display_info) if every else self.host_libraries()
        if not made:
            return
        compiler = f"ziglang {installed_version('ziglang')}" if every else "of the host"
        self.folder = tempfile.mkdtemp(prefix="prbm_")
        for name, content in package_files(made, compiler, kernel()).items():
            path = Path(self.folder) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
            path.chmod(0o644)
            build_data["force_include"][str(path)] = f"prbm/kernel/{name}"
        if not every:
            build_data["pure_python"] = False
            build_data["tag"] = f"py3-none-{host_tag()}"

    def host_libraries(self) -> dict[str, bytes]:
        """Return the libraries of this machine, or none, with a message."""
        from prbm.kernel.compiler import HOST, PRODUCTS, CompilerError, Product, libraries

        def compiled(product: Product) -> dict[str, bytes]:
            found = libraries([HOST], self.app.display_info, product)
            return {f"{HOST}/{product.name}{p.suffix}": found[p] for p in found}

        try:
            with ThreadPoolExecutor() as pool:
                parts = [*pool.map(compiled, PRODUCTS)]
        except CompilerError as error:
            self.app.display_warning(
                f"the package has no compiled library; simulations take about a hundred times "
                f"longer until there is a compiler: {error}"
            )
            return {}
        return {name: content for part in parts for name, content in part.items()}

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove the temporary files."""
        if hasattr(self, "folder"):
            shutil.rmtree(self.folder)


class ReadmeHook(MetadataHookInterface):
    """Set the readme and the addresses of the project."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Add ``readme`` and ``urls`` to the metadata."""
        address = repository()
        text = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        content = {"content-type": "text/markdown", "text": rendered(text, address)}
        metadata["readme"] = content
        pages = {"Source": "", "Issues": "/issues", "Changes": "/blob/main/CHANGELOG.md"}
        metadata["urls"] = {name: address + page for name, page in pages.items() if address}


def repository() -> str:
    """Return the address of the repository on its web server; empty if it is not known."""
    given = os.environ.get("PRBM_REPOSITORY", "").strip().rstrip("/")
    server, name = (os.environ.get(f"GITHUB_{x}", "") for x in ("SERVER_URL", "REPOSITORY"))
    return given or (f"{server}/{name}" if server and name else "")


def rendered(text: str, address: str) -> str:
    """Return a Markdown text with links that do not depend on its folder.

    Without an address, links keep their texts and pictures their descriptions.
    """

    def link(match: re.Match[str]) -> str:
        picture, name, target = match.groups()
        if not address or target.startswith("#"):
            return "" if picture else name
        return f"{picture}[{name}]({address}/{'raw' if picture else 'blob'}/main/{target})"

    return LINK.sub(link, text)


def all_libraries(progress: Callable[[str], None]) -> dict[str, bytes]:
    """Return the libraries of all platforms, and the module of web pages."""
    from prbm.kernel.compiler import ALL, BROWSER, LIVE, PRODUCTS, browser_module, libraries

    made = {
        f"{platform.name}/{product.name}{platform.suffix}": content
        for product in PRODUCTS
        for platform, content in libraries([ALL], progress, product).items()
    }
    return made | {f"{BROWSER.name}/{LIVE.name}{BROWSER.suffix}": browser_module(progress)}


def host_tag() -> str:
    """Return the platform tag of wheels for this machine alone."""
    return next(tag for tag in platform_tags() if not tag.startswith(("manylinux", "musllinux")))
