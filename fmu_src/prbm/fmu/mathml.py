r"""Formulas as MathML, from plain text.

A formula consists of letters, numbers and operators; ``_`` and ``^`` begin a subscript and a
superscript, braces group, ``bar(x)`` is a conjugate and ``dot(x)`` a rate.  Greek letters are
written by name.
"""

import html
import re
from collections.abc import Sequence

from ..base.text import printable

GREEK = {
    "alpha": "\u03b1", "beta": "β", "epsilon": "ε", "zeta": "ζ", "lambda": "λ", "mu": "μ",
    "omega": "ω", "Lambda": "Λ", "Phi": "Φ",
}  # fmt: skip
FUNCTIONS = {"Re", "Im", "abs", "diag", "exp", "max", "sgn"}
WORDS = {
    "position", "displacement", "restitution", "springs", "gravity", "damping", "friction",
    "inputs", "force",
}  # fmt: skip
OPERATORS = {"-": "\u2212", "<=": "≤", ">=": "≥"}
ACCENTS = {"bar": "¯", "dot": "˙"}
NAMES = sorted({*GREEK, *FUNCTIONS, *WORDS, *ACCENTS}, key=len, reverse=True)
TOKEN = re.compile(rf"\s*({'|'.join(NAMES)}|\d+(?:\.\d+)?|<=|>=|\S)")
SPACE = '<mspace width=".25em"/>'
GAP = '<mspace width="1.6em"/>'


def formula(*texts: str) -> str:
    """Return formulas, one beside the other, as a block of MathML.

    Examples
    --------
    >>> formula("x_i >= 0").removeprefix('<math display="block">').removesuffix("</math>")
    '<mrow><msub><mi>x</mi><mi>i</mi></msub><mo>≥</mo><mn>0</mn></mrow>'
    """
    return block(GAP.join(row(text) for text in texts))


def inline(text: str) -> str:
    """Return a formula as MathML within a line of text."""
    return f"<math>{row(text)}</math>"


def row(text: str) -> str:
    """Return a formula as a row of MathML."""
    return _Reader(text).row()


def matrix(rows: Sequence[Sequence[str]]) -> str:
    """Return a matrix of formulas as MathML; the style sheet of the page draws its brackets."""
    cells = "".join(
        "<mtr>" + "".join(f"<mtd>{row(cell)}</mtd>" for cell in cells) + "</mtr>" for cells in rows
    )
    return f'<mtable class="matrix">{cells}</mtable>'


def block(*parts: str) -> str:
    """Return parts in MathML as one displayed formula."""
    return f'<math display="block">{"".join(parts)}</math>'


class _Reader:
    """A formula that is being read."""

    def __init__(self, text: str) -> None:
        self.tokens: list[str] = TOKEN.findall(text)

    def row(self, end: str = "") -> str:
        parts = []
        while self.tokens and self.tokens[0] != end:
            parts.append(self.scripted())
        if end:
            self.tokens.pop(0)
        return f"<mrow>{''.join(parts)}</mrow>"

    def scripted(self) -> str:
        base, scripts = self.atom(), {}
        while self.tokens and self.tokens[0] in ("_", "^"):
            mark = self.tokens.pop(0)
            scripts[mark] = self.atom()
        if len(scripts) == 2:
            return f"<msubsup>{base}{scripts['_']}{scripts['^']}</msubsup>"
        if "_" in scripts:
            return f"<msub>{base}{scripts['_']}</msub>"
        if "^" in scripts:
            return f"<msup>{base}{scripts['^']}</msup>"
        return base

    def atom(self) -> str:
        token = self.tokens.pop(0)
        if token == "{":
            return self.row("}")
        if token in ACCENTS:
            self.tokens.pop(0)
            return f"<mover>{self.row(')')}<mo>{ACCENTS[token]}</mo></mover>"
        if token[0].isdigit():
            return f"<mn>{token}</mn>"
        if token in FUNCTIONS | WORDS:
            follows = token in WORDS and self.tokens and self.tokens[0] not in "+-,)"
            return f"<mtext>{token}</mtext>" + (SPACE if follows else "")
        if token[0].isalpha():
            return f"<mi>{GREEK.get(token, token)}</mi>"
        return f"<mo>{html.escape(OPERATORS.get(token, token), quote=False)}</mo>"


def escape(text: str) -> str:
    """Return a text escaped for HTML, without unprintable characters."""
    return "\n".join(html.escape(printable(line)) for line in text.splitlines())
