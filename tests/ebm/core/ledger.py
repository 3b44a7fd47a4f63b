"""What the event core is made of, counted: small numbers, zeros, modelling choices, complexity.

`python tests/ebm/core/ledger.py` prints it.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import rockcheck.ebm
from rockcheck.ebm.core import rules

FOLDER = Path(rockcheck.ebm.__file__).parent
#: What counts as a small number, and the zeros: where they are defined, and of what.
SMALL = 2e-3
ZEROS = {
    "position": ("core/contacts.py", "CLOSED"),
    "velocity": ("core/contacts.py", "SLOW"),
    "time": ("core/series.py", "INSTANT"),
}
#: Statements and expressions at which a path divides, as ruff's C901 counts them.
_BRANCHES = (ast.If, ast.For, ast.While, ast.ExceptHandler, ast.comprehension, ast.match_case)


def sources() -> dict[str, ast.Module]:
    """The modules of the package, parsed, by path in it."""
    return {
        path.relative_to(FOLDER).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
        for path in sorted(FOLDER.rglob("*.py"))
    }


def small_numbers() -> list[tuple[str, int, float]]:
    """Float literals below SMALL: file, line, value."""
    return [
        (name, node.lineno, node.value)
        for name, tree in sources().items()
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant)
        and isinstance(node.value, float)
        and 0.0 < abs(node.value) < SMALL
    ]


def homes(rule: str) -> set[str]:
    """The modules in which a modelling choice is counted."""
    found = set()
    for name, tree in sources().items():
        for node in ast.walk(tree):
            if isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Subscript):
                found |= {
                    name
                    for part in ast.walk(node.target.slice)
                    if isinstance(part, ast.Attribute) and part.attr == rule
                }
    return found


def names_of_rules() -> dict[str, str]:
    """The choices of ebm.core.rules and the names that they stand for."""
    return {rule.name: rules.NAMES[rule] for rule in rules.Rule}


def complexities() -> list[tuple[int, str]]:
    """Cyclomatic complexity of every function, the largest first."""
    functions = [
        (name, node)
        for name, tree in sources().items()
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef)
    ]
    sizes = (
        (1 + sum(isinstance(part, _BRANCHES) for part in ast.walk(node)), f"{name} {node.name}")
        for name, node in functions
    )
    return sorted(sizes, reverse=True)


def lines() -> Iterator[str]:
    """The ledger as text."""
    small = small_numbers()
    yield f"small numbers: {len(small)} float literals below {SMALL:g}"
    yield from (f"  {file}:{line}  {value:g}" for file, line, value in small)
    yield "zeros: " + ", ".join(f"{kind} {file} {name}" for kind, (file, name) in ZEROS.items())
    names = names_of_rules()
    yield f"modelling choices: {len(names)}"
    yield from (f"  {name} ({', '.join(sorted(homes(key)))})" for key, name in names.items())
    yield "most complex functions: " + ", ".join(
        f"{where} {size}" for size, where in complexities()[:3]
    )


if __name__ == "__main__":
    print("\n".join(lines()))
