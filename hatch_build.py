"""Build hook: libraries of the kernel for all platforms, as a part of the wheel.

The hook is disabled by default.  It is enabled by the environment variable
``HATCH_BUILD_HOOK_ENABLE_CUSTOM=true`` and needs the Python package ``ziglang``.
"""

import sys
import tempfile
from importlib.metadata import version as installed_version
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class LibrariesHook(BuildHookInterface):  # type: ignore[type-arg]
    """Compile the kernel for every platform and product, and add the libraries to a wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile the libraries, unless an editable installation is built."""
        if version == "editable":
            return
        sys.path.insert(0, str(Path(self.root) / "fmu_src"))
        from prbm.kernel.compiler import ALL, BROWSER, LIVE, PRODUCTS, browser_module, libraries
        from prbm.kernel.prebuilt import package_files
        from prbm.kernel.sources import kernel

        made = {
            f"{platform.name}/{product.name}{platform.suffix}": content
            for product in PRODUCTS
            for platform, content in libraries([ALL], self.app.display_info, product).items()
        }
        made[f"{BROWSER.name}/{LIVE.name}{BROWSER.suffix}"] = browser_module(self.app.display_info)
        compiler = f"ziglang {installed_version('ziglang')}"
        self.folder = tempfile.TemporaryDirectory(prefix="prbm_")
        for name, content in package_files(made, compiler, kernel()).items():
            path = Path(self.folder.name) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
            path.chmod(0o644)
            build_data["force_include"][str(path)] = f"prbm/kernel/{name}"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove the temporary files."""
        if version != "editable":
            self.folder.cleanup()
