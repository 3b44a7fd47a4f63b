"""A hook of MkDocs: numbers such as 1e-12 and short code such as `ebm-unilateral` are not broken at
a hyphen; comments are left out."""

from __future__ import annotations

import re
from typing import Any

#: What holds no running text, and single tags.
APART = re.compile(
    r"(<!--.*?-->|<pre.*?</pre>|<math.*?</math>|<code>.*?</code>|<[^>]+>)", re.DOTALL
)
NUMBER = re.compile(r"\b\d+(?:\.\d+)?e-\d+\b")
#: Characters of code that fit on a phone's line.
SHORT = 26


def on_page_content(html: str, **_: Any) -> str:
    """The page with its numbers and its short code held together."""
    return "".join(_held(part) for part in APART.split(html))


def _held(part: str) -> str:
    if part.startswith("<!--"):
        return ""
    if part.startswith("<code>"):
        return (
            part.replace("<code>", '<code class="unbroken">', 1)
            if len(part) <= SHORT + len("<code></code>")
            else part
        )
    return (
        part if part.startswith("<") else NUMBER.sub(r'<span class="unbroken">\g<0></span>', part)
    )
