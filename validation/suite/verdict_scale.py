"""The verdicts of a suite's run, from a check to an exit code: all of them stand here.

In: a check's verdict. Out: what it counts as, in a cell and in a run. `results` and everything that
shows a run ask it.

| on | for | values | made by |
|---|---|---|---|
| a check | people and machines | `CheckVerdict` | `verdicts` |
| a check, in its cell | | `CheckWeight` | `WEIGHTS` |
| a cell, a run | people | `VerdictWords`, the worst last | the worst of the checks or cells |
| a cell, a run | machines, colours | `finding.Verdict` | `FOR_MACHINES` |
| a run | the shell | exit code | `Run.exit_code`, with `FAILS` |
"""

from collections.abc import Mapping
from typing import Literal

from rockcheck.validation.finding import Verdict

#: Verdict on one check: as expected; nearer to the perfect value; a ratio to zero; inside the
#: limit, but outside the drift band; outside the limit or not to be judged. See `tolerances`.
CheckVerdict = Literal["pass", "better", "not defined", "changed", "fail"]
#: What a check counts as in the verdict on its cell.
CheckWeight = Literal["pass", "changed", "fail"]
WEIGHTS: Mapping[CheckVerdict, CheckWeight] = {
    "pass": "pass",
    "better": "pass",
    "not defined": "pass",
    "changed": "changed",
    "fail": "fail",
}
#: Verdict on a cell or a run for people: the worst of its checks, "incomplete" where a model is not
#: installed, "error" where one failed. What waits for nothing but tolerances has not failed.
VerdictWords = Literal[
    "not judged", "pass", "incomplete", "changed", "no tolerance yet", "fail", "error"
]
#: The verdict for machines by that for people, the worst last.
FOR_MACHINES: Mapping[VerdictWords, Verdict] = {
    "not judged": "pass",
    "pass": "pass",
    "incomplete": "incomplete",
    "changed": "changed",
    "no tolerance yet": "fail",
    "fail": "fail",
    "error": "error",
}
#: The verdicts for people, the worst last.
SEVERITY = tuple(FOR_MACHINES)
#: What fails besides figures out of a limit: nothing; changed figures and a model that is not
#: installed; "both": better figures, too.
Strict = bool | Literal["both"]
FAILS: Mapping[Strict, tuple[CheckVerdict, ...]] = {
    False: ("fail",),
    True: ("fail", "changed"),
    "both": ("fail", "changed", "better"),
}
