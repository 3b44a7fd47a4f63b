"""A hook of MkDocs: equations become MathML when the site is built, so that a page needs no script
and no font to show them."""

from __future__ import annotations

import re
from html import unescape
from typing import Any

from math_core import LatexToMathML

#: What `pymdownx.arithmatex` (generic) leaves: \( inline \) in a span, \[ display \] in a div.
EQUATION = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.DOTALL)


def on_page_content(html: str, **_: Any) -> str:
    """The page with its equations as MathML."""
    return EQUATION.sub(_as_mathml, html)


def _as_mathml(found: re.Match[str]) -> str:
    mathml = LatexToMathML().convert_with_local_state(
        unescape(found[3]).strip(), displaystyle=found[2] == "["
    )
    return f'<{found[1]} class="equation">{mathml}</{found[1]}>'
