"""The content security policy of pages."""

import base64
import hashlib


def policy(style: str, script: str = "") -> str:
    """Return the content security policy of a page: its own style and script, and nothing else.

    Other scripts, styles, requests, images, frames and forms are forbidden, also those that a text
    of a mechanism could contain.  The script may compile WebAssembly, as the kernel in the page.

    Parameters
    ----------
    style, script : str
        Content of the only style element and of the only script that runs.

    Examples
    --------
    >>> policy("").split("; ")[2:]
    ["base-uri 'none'", "form-action 'none'"]
    """
    code = f"; script-src {_source(script)} 'wasm-unsafe-eval'" if script else ""
    return (
        f"default-src 'none'; style-src {_source(style)}{code}; base-uri 'none'; form-action 'none'"
    )


def _source(text: str) -> str:
    """Return the source that permits an element with a text."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
