"""Do the tests notice? `python tests/mutation.py` plants small faults in the source, one at a time,
and runs the tests that should fail.

A sample of all faults that the operators below can make, drawn with a seed: comparisons that
include their limit or do not, signs, products for quotients, `and` for `or`, negated conditions,
changed numbers. Each is planted in a copy of the packages, which is interpreted
(NUMBA_DISABLE_JIT=1), but for the files in COMPILED. Faults that survive are printed with file and
line; those that nothing can notice are in EQUIVALENT. Arguments: `--sample N` faults a file,
`--seed N`, `--file NAME` (repeatable), and after `--` what pytest is given, too.
"""

from __future__ import annotations

import argparse
import ast
import copy
import importlib
import os
import random
import shutil
import signal
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
CLOSED = "tests/ebm/test_closed_forms.py::test_"
POPULATION = "tests/validation/studies/test_population.py"
UNCERTAINTY = "tests/validation/discrepancy/test_uncertainty.py"
#: Where faults are planted, and the tests that should notice them, the quickest first.
TARGETS = {
    "ebm/core/series.py": ["tests/ebm/core/test_core_parts.py"],
    "ebm/core/laws/impacts.py": [
        "tests/ebm/core/test_impact_laws.py",
        f"{CLOSED}wall_impact_balances_momentum",
        f"{CLOSED}floor_impact_balances_momentum",
    ],
    "ebm/core/laws/contact_impacts.py": [
        "tests/ebm/core/test_impact_laws.py",
        f"{CLOSED}contact_impact_leaves_no_approach",
        "tests/ebm/test_edges.py",
    ],
    "ebm/core/guards.py": ["tests/ebm/core/test_core_parts.py", "tests/ebm/test_edges.py"],
    "ebm/core/modes.py": ["tests/ebm/core/test_core_parts.py", "tests/ebm/test_edges.py"],
    "validation/suite/tolerances.py": [
        "tests/validation/suite/test_verdicts.py",
        "tests/validation/suite/test_tolerances.py",
    ],
    "validation/suite/tables.py": [
        "tests/validation/suite/test_verdicts.py",
        "tests/validation/suite/test_impact_laws.py",
        "tests/commands/test_cli.py",
    ],
    "validation/criteria.py": ["tests/validation/test_criteria.py"],
    "validation/discrepancy/motion.py": ["tests/validation/studies/test_assess.py"],
    "validation/studies/population/answers.py": ["tests/validation/studies/test_assess.py"],
    "validation/discrepancy/statistics.py": [
        "tests/validation/suite/test_statistics.py",
        "tests/validation/suite/test_ensembles.py",
    ],
    **{
        f"validation/discrepancy/{name}.py": [
            "tests/validation/discrepancy/test_measures.py",
            "tests/validation/discrepancy/test_measured.py",
            "tests/validation/discrepancy/test_closed_forms.py",
        ]
        for name in ("compare", "figures", "measures")
    },
    "validation/suite/results.py": [
        "tests/validation/suite/test_verdicts.py",
        "tests/commands/test_cli.py",
    ],
    "ebm/core/settle.py": ["tests/ebm/core/test_impact_laws.py", "tests/ebm/test_edges.py"],
    "ebm/core/laws/strike.py": [
        "tests/ebm/core/test_impact_laws.py",
        f"{CLOSED}wall_impact_balances_momentum",
        f"{CLOSED}floor_impact_balances_momentum",
        f"{CLOSED}contact_impact_leaves_no_approach",
        "tests/ebm/test_edges.py",
    ],
    "ebm/core/march.py": ["tests/ebm/core/test_core_parts.py", "tests/ebm/test_edges.py"],
    "scenes/block.py": [
        "tests/scenes/test_scene.py",
        "tests/ebm/test_loaded_blocks.py::test_pivots_of_a_block",
    ],
    "scenes/files.py": [
        "tests/scenes/test_inputs.py",
        "tests/scenes/test_files.py",
        UNCERTAINTY,
        "-k",
        "inputs or files or scene_file or correlated or faults",
    ],
    "scenes/recordings/sets.py": [
        "tests/scenes/test_record_sets.py",
        "tests/scenes/test_recordings.py",
    ],
    "scenes/recordings/intensity.py": ["tests/scenes/test_intensity.py"],
    "validation/uncertainty/numerical.py": [
        UNCERTAINTY,
        "-k",
        "index or order or step or tolerance or peak or small or interval_covers or own_error"
        " or what_a_difference_says",
    ],
    "validation/uncertainty/population.py": [
        "tests/validation/discrepancy/test_propagation.py",
        POPULATION,
        UNCERTAINTY,
        "-k",
        "propagation or sobol or refused or population",
    ],
    "validation/studies/population/study.py": [POPULATION],
    "ebm/horizon.py": ["tests/ebm/test_horizon.py"],
}
#: Files that are never compiled, whose tests play more motions than an interpreter can: what they
#: call is compiled.
COMPILED = {
    "validation/uncertainty/numerical.py",
    "validation/uncertainty/population.py",
    "validation/studies/population/study.py",
    "ebm/horizon.py",
}
#: What hangs is noticed: after so long in the processor, or in twenty times that by the clock,
#: which a busy machine does not reach.
SECONDS = 180
#: Faults that change no result, by file, a part of the line (of a number: of the expression that it
#: stands in), the text of the fault, and why.
EQUIVALENT = {
    (
        "validation/uncertainty/numerical.py",
        "(1.0, 2.0, ",
        "1.0  ->  100.0",
    ): (
        "the finest run is the one at the model's own step: only the factors of the coarser ones"
        " are used"
    ),
    (
        "validation/uncertainty/numerical.py",
        "largest <= ROUNDING",
        "largest <= ROUNDING * scale  ->  largest < ROUNDING * scale",
    ): "equal to the last bit",
    (
        "ebm/horizon.py",
        "tolerance=1e-13",
        "1e-13  ->  1.0000000000000001e-11",
    ): "still far below the perturbation",
    (
        "validation/uncertainty/population.py",
        "0.9 * draws",
        "len(known) >= 0.9 * draws  ->  len(known) > 0.9 * draws",
    ): "one more fit of 200",
    (
        "ebm/core/settle.py",
        "[SETTLE, -1.0, -1.0",
        "1.0  ->  100.0",
    ): "any time long before the first impact",
    (
        "ebm/core/series.py",
        "stack",
        "top + 2  ->  top - 2",
    ): "the narrowest interval ends the search before the stack is full",
    (
        "ebm/core/series.py",
        "a[row, 0] + low",
        "a[row, 0] > floor  ->  a[row, 0] >= floor",
    ): "a bound that saves the search, met or not",
    (
        "ebm/core/laws/impacts.py",
        "abs(q) <= mu_s * p",
        "S2 * w2 >= 0.0  ->  S2 * w2 > 0.0",
    ): "a block that an impact stops, by the last bit of its slenderness, lies flat either way",
    (
        "ebm/core/laws/impacts.py",
        "-1.0 if q > 0.0",
        "-1.0  ->  1.0",
    ): (
        "at most one of the two slips is consistent up to friction 4/3, so that it does not matter"
        " which is tried first"
    ),
    (
        "ebm/core/laws/contact_impacts.py",
        "_MOST_STAGES = 40",
        "40  ->  41",
    ): "no impact that ends takes as many stages",
    (
        "ebm/core/laws/contact_impacts.py",
        "1.0 if floor",
        "1.0  ->  100.0",
    ): "a unit of distance",
    (
        "ebm/core/guards.py",
        "tau, -1",
        "1  ->  2",
    ): "any negative number says that there is no event",
    (
        "ebm/core/guards.py",
        "_has(a, wall, 0)",
        "0  ->  1",
    ): "one term of the gap's series fewer, which is below the tolerance",
    (
        "ebm/core/guards.py",
        "_has(a, G_LANDING, 0)",
        "0  ->  1",
    ): "one term of the gap's series fewer, which is below the tolerance",
    (
        "ebm/core/guards.py",
        "gap < np.inf",
        "TIP if wall == G_TIP_GAP else FAR  ->  TIP if not wall == G_TIP_GAP else FAR",
    ): "on one wall the other's gap cannot close, and its own is zero throughout",
    (
        "ebm/core/modes.py",
        "m[PULL] < 0 and (b.unilateral",
        "m[PULL] < 0  ->  m[PULL] <= 0",
    ): "a floor pushes or pulls: it is never 0",
    ("ebm/core/modes.py", "m[PULL] < 0", "0  ->  1"): "a floor pushes or pulls, 1 or -1",
    (
        "ebm/core/modes.py",
        "_touched(b, z, 1, True)",
        "1  ->  2",
    ): "of an upright block both sides are looked at, whatever the sense",
    ("ebm/core/modes.py", "if flat else 0", "0  ->  1"): "only a flat block asks for it",
    (
        "ebm/core/guards.py",
        "a[PHI, 0] > 0.5",
        "a[PHI, 0] > 0.5  ->  a[PHI, 0] >= 0.5",
    ): "a bound that saves the guards, met or not",
    (
        "ebm/core/guards.py",
        "root < tau",
        "root < tau - (INSTANT if closes else 0.0)  ->  root <= tau - (INSTANT if closes else 0.0)",
    ): "equal to the last bit",
}

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


def changed(node: ast.AST) -> Iterator[ast.AST]:
    """The node with a fault, once for each that it can have."""
    fault = copy.deepcopy(node)
    if isinstance(fault, ast.Compare) and len(fault.ops) == 1 and type(fault.ops[0]) in SWAPS:
        fault.ops = [SWAPS[type(fault.ops[0])]()]
        yield fault
    elif (
        isinstance(fault, ast.BinOp)
        and isinstance(fault.right, ast.Name)
        and fault.right.id in SIGNS
    ):
        return  # to divide by one is to multiply by it
    elif isinstance(fault, ast.BinOp | ast.AugAssign | ast.BoolOp) and type(fault.op) in SWAPS:
        fault.op = SWAPS[type(fault.op)]()
        yield fault
    elif isinstance(fault, ast.UnaryOp) and isinstance(fault.op, ast.Not | ast.USub):
        yield fault.operand
    elif isinstance(fault, ast.If | ast.While | ast.IfExp):
        fault.test = ast.UnaryOp(ast.Not(), fault.test)
        yield fault
    elif isinstance(fault, ast.Constant) and type(fault.value) in (int, float):
        fault.value = (
            fault.value * 100.0
            if isinstance(fault.value, float) and fault.value
            else fault.value + 1
        )
        yield fault


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
        for fault in changed(node):
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
        if not isinstance(node, ast.Constant):
            return ""
        return next(
            ast.unparse(one) for one in reversed(self.within) if not isinstance(one, ast.UnaryOp)
        )


def shown(node: ast.AST) -> str:
    return ast.unparse(node.test if isinstance(node, ast.If | ast.While) else node).replace(
        "\n", " "
    )[:90]


class PlainCore:
    """For pytest: what is compiled is that of the plain sources here, which no fault changes."""

    def pytest_configure(self) -> None:
        """Before tests are imported, and with them what is compiled."""
        from rockcheck.scenes import compiled

        kept = compiled._cache_folder
        compiled._cache_folder = lambda package: kept(ROOT / package.name)  # type: ignore[assignment]


def survives(tree: Path, name: str, source: str, arguments: list[str]) -> bool:
    """Whether all tests pass with this source; what hangs is noticed. In a process that begins with
    the libraries loaded."""
    path = tree / "rockcheck" / name
    plain = path.read_text(encoding="utf-8")
    child = os.fork()
    if child == 0:
        try:
            signal.setitimer(signal.ITIMER_PROF, SECONDS)
            signal.alarm(20 * SECONDS)
            os.environ["NUMBA_DISABLE_JIT"] = str(int(name not in COMPILED))
            sys.modules["numba"].config.reload_config()
            path.write_text(source, encoding="utf-8")
            quiet = os.open(os.devnull, os.O_WRONLY)
            os.dup2(quiet, 1)
            os.dup2(quiet, 2)
            import pytest

            words = [
                "-x",
                "-q",
                "-p",
                "no:cacheprovider",
                "-m",
                "not slow and not browser",
                *arguments,
            ]
            code = int(pytest.main(words, plugins=[PlainCore()] if name in COMPILED else []))
        except BaseException:
            code = 9
        finally:
            os._exit(code)
    _, status = os.waitpid(child, 0)
    path.write_text(plain, encoding="utf-8")
    return status == 0


def main() -> None:
    """Plants, runs, counts; exit 1 where fewer than 95 of 100 are noticed."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--sample", type=int, default=12)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--file", action="append")
    parser.add_argument("pytest", nargs="*")
    asked = parser.parse_args()
    os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
    sys.dont_write_bytecode = True
    os.chdir(ROOT)
    killed = total = 0
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder)
        shutil.copytree(
            ROOT / "rockcheck", tree / "rockcheck", ignore=shutil.ignore_patterns("__pycache__")
        )
        sys.path.insert(0, folder)
        os.environ["PYTHONPATH"] = folder
        for library in ("numba", "pandas", "pydantic", "scipy.integrate", "scipy.stats"):
            importlib.import_module(library)  # once for all children
        for name, tests in TARGETS.items():
            if asked.file and not any(part in name for part in asked.file):
                continue
            source = (ROOT / name).read_text(encoding="utf-8")
            lines = source.splitlines()
            listed = Plant()
            listed.visit(ast.parse(source))
            if not survives(tree, name, source, [*tests, *asked.pytest]):
                sys.exit(f"{name}: its tests fail without a fault")
            chosen = sorted(
                random.Random(f"{asked.seed} {name}").sample(
                    range(len(listed.found)), min(asked.sample, len(listed.found))
                )
            )
            noticed = judged = 0
            for index in chosen:
                line, text, around = listed.found[index]
                if any(
                    (file, fault) == (name, text) and part in (around or lines[line - 1])
                    for file, part, fault in EQUIVALENT
                ):
                    continue
                fault = ast.unparse(
                    ast.fix_missing_locations(Plant(index).visit(ast.parse(source)))
                )
                judged += 1
                lives = survives(tree, name, fault, [*tests, *asked.pytest])
                noticed += not lives
                if lives:
                    print(
                        f"survives  {name}:{line}  {text}" + (f"  in  {around}" if around else ""),
                        flush=True,
                    )
            print(
                f"{name}: {noticed} of {judged} noticed ({len(listed.found)} possible)", flush=True
            )
            killed, total = killed + noticed, total + judged
    print(f"{killed} of {total} noticed, {100.0 * killed / max(total, 1):.0f} %")
    sys.exit(killed < 0.95 * total)


if __name__ == "__main__":
    main()
