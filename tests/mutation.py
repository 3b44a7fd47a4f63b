"""Do the tests notice? `python tests/mutation.py` plants small faults in the source, one at a time,
and runs the tests that should fail.

A sample of all faults that the operators below can make, drawn with a seed: comparisons that
include their limit or do not, signs, products for quotients, `and` for `or`, negated conditions,
changed numbers. Each is planted in a copy of the packages of its own, and as many are tried at a
time as there are cores. Faults that survive are printed with file and line. Files, tests and the
faults that nothing can notice are in data/mutation.toml. Arguments: `--sample N` faults a file,
`--seed N`, `--file NAME` (repeatable), and after `--` what pytest is given, too.
"""

import ast
import copy
import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Annotated

import typer

ROOT = Path(__file__).parents[1]
#: Where faults are planted, the tests that should notice them, and faults that nothing can notice.
DATA = tomllib.loads((ROOT / "tests" / "data" / "mutation.toml").read_text(encoding="utf-8"))
#: What hangs is noticed: after so long in the processor, or in five times that by the clock, which
#: a busy machine does not reach. To compile the event core and run its tests takes half of it.
SECONDS = 600

#: Names of numbers that are 1 or -1.
SIGNS = {"S", "S1", "S2", "Sw", "Sr", "sy", "d", "sense", "side", "sign"}
SWAPS: dict[type, type] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.And: ast.Or,
    ast.Or: ast.And,
}


def changed(node: ast.AST) -> ast.AST | None:
    """The node with a fault, if it can have one."""
    fault = copy.deepcopy(node)
    if isinstance(fault, ast.Compare) and len(fault.ops) == 1 and type(fault.ops[0]) in SWAPS:
        fault.ops = [SWAPS[type(fault.ops[0])]()]
    elif isinstance(fault, ast.BinOp | ast.AugAssign | ast.BoolOp) and type(fault.op) in SWAPS:
        by = getattr(fault, "right", None)
        if isinstance(by, ast.Name) and by.id in SIGNS:
            return None  # to divide by one is to multiply by it
        fault.op = SWAPS[type(fault.op)]()
    elif isinstance(fault, ast.UnaryOp) and isinstance(fault.op, ast.Not | ast.USub):
        return fault.operand
    elif isinstance(fault, ast.If | ast.While | ast.IfExp):
        fault.test = ast.UnaryOp(ast.Not(), fault.test)
    elif isinstance(fault, ast.Constant) and type(fault.value) in (int, float):
        is_real = isinstance(fault.value, float) and fault.value
        fault.value = fault.value * 100.0 if is_real else fault.value + 1
    else:
        return None
    return fault


class Plant(ast.NodeTransformer):
    """Puts one fault in the place of the `index`-th node; without an index it lists them all."""

    def __init__(self, index: int = -1) -> None:
        self.index, self.found, self.within = index, list[tuple[int, str, str]](), list[ast.AST]()

    def visit(self, node: ast.AST) -> ast.AST:
        """The texts of errors and the numbers of an enumeration hold no fault."""
        if isinstance(node, ast.Raise | ast.JoinedStr) or (
            isinstance(node, ast.Assign)
            and isinstance(node.targets[0], ast.Tuple)
            and not node.col_offset
        ):
            return node
        if fault := changed(node):
            line = getattr(node, "lineno", 0)
            self.found.append((line, f"{shown(node)}  ->  {shown(fault)}", self._around(node)))
            if len(self.found) - 1 == self.index:
                return ast.copy_location(fault, node)
        self.within.append(node)
        kept = self.generic_visit(node)
        self.within.pop()
        return kept

    def _around(self, node: ast.AST) -> str:
        """Of a number the expression that it stands in: a line may hold the same number more than
        once."""
        outside = (one for one in reversed(self.within) if not isinstance(one, ast.UnaryOp))
        return ast.unparse(next(outside)) if isinstance(node, ast.Constant) else ""


def shown(node: ast.AST) -> str:
    return ast.unparse(node.test if isinstance(node, ast.If | ast.While) else node).replace(
        "\n", " "
    )[:90]


def is_told(one: dict[str, str], fault: tuple[int, str, str], lines: list[str]) -> bool:
    """Whether an entry of `equivalent` is of this fault of a file of these lines."""
    line, text, around = fault
    return one["fault"] == text and one["part"] in (around or lines[line - 1])


def survives(
    name: str, source: str, target: dict[str, list[str]], more: list[str], cache: str
) -> bool:
    """Whether all tests of the target pass with this source; what hangs is noticed.

    Those that are quick without the compiler come first: it takes longer than they do. `more` is
    given to pytest, too; `cache` keeps what is compiled, by the content of its package."""
    words = ["-x", "-q", "-p", "no:cacheprovider", "-m", "not slow and not browser", *more]
    with tempfile.TemporaryDirectory() as tree:
        shutil.copytree(
            ROOT / "rockcheck", f"{tree}/rockcheck", ignore=shutil.ignore_patterns("__pycache__")
        )
        Path(tree, "rockcheck", name).write_text(source, encoding="utf-8")
        environment = {
            "PYTHONPATH": tree,
            "PYTHONDONTWRITEBYTECODE": "1",
            "NUMBA_CACHE_DIR": cache,
        }
        try:
            return not any(
                subprocess.run(
                    [sys.executable, "-P", "-m", "pytest", *words, *target[tests]],
                    cwd=ROOT,
                    env=os.environ | environment | {"NUMBA_DISABLE_JIT": uncompiled},
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                    timeout=5 * SECONDS,
                    preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS)),
                ).returncode
                for tests, uncompiled in (("interpreted", "1"), ("tests", "0"))
                if tests in target
            )
        except subprocess.TimeoutExpired:
            return False


def main(
    pytest: Annotated[list[str] | None, typer.Argument()] = None,
    sample: int = 12,
    seed: int = 1,
    file: list[str] | None = None,
) -> None:
    """Plants, runs, counts; exit 1 where fewer than 95 of 100 are noticed."""
    killed, total, sound = 0, 0, list[object]()
    with tempfile.TemporaryDirectory() as cache, ThreadPoolExecutor(os.cpu_count()) as workers:
        for name, target in ((name, one) for one in DATA["target"] for name in one["files"]):
            if file and not any(part in name for part in file):
                continue
            source = (ROOT / "rockcheck" / name).read_text(encoding="utf-8")
            lines = source.splitlines()
            listed = Plant()
            listed.visit(ast.parse(source))
            equivalent = [one for one in DATA["equivalent"] if one["file"] == name]
            for one in equivalent:
                if not any(is_told(one, fault, lines) for fault in listed.found):
                    sys.exit(f"{name}: mutation.toml tells of a fault that is none: {one['fault']}")
            if target not in sound and not survives(name, source, target, pytest or [], cache):
                sys.exit(f"{name}: its tests fail without a fault")
            sound.append(target)
            possible = range(len(listed.found))
            chosen = random.Random(f"{seed} {name}").sample(possible, min(sample, len(possible)))
            lives = {
                index: workers.submit(
                    survives,
                    name,
                    ast.unparse(ast.fix_missing_locations(Plant(index).visit(ast.parse(source)))),
                    target,
                    pytest or [],
                    cache,
                )
                for index in sorted(chosen)
                if not any(is_told(one, listed.found[index], lines) for one in equivalent)
            }
            for index, answer in lives.items():
                if answer.result():
                    line, text, around = listed.found[index]
                    within = f"  in  {around}" * bool(around)
                    print(f"survives  {name}:{line}  {text}{within}", flush=True)
            noticed = sum(not answer.result() for answer in lives.values())
            print(
                f"{name}: {noticed} of {len(lives)} noticed ({len(possible)} possible)", flush=True
            )
            killed, total = killed + noticed, total + len(lives)
    print(f"{killed} of {total} noticed, {100.0 * killed / max(total, 1):.0f} %")
    sys.exit(killed < 0.95 * total)


if __name__ == "__main__":
    typer.run(main)
