"""`rockcheck assess`: a scene under its motions, draws, gaps and intensities, and what it answers.

Data goes one way: `plan` (what is played) -> `tasks` (a run or a batch) -> `results` (what is kept
of it) -> `gathered` (by case) -> `statistics` (an answer in numbers) -> `sentences`, `blocks` and
`data` (the answer in words, as tables and plots, as JSON) -> `study` (the questions, in order).

A new answer is a question in `study`, a record and a function in `statistics`, one function each in
`sentences`, `blocks` and `data`, and a row in docs/assess.md. One that needs a new figure of each
run needs more: a field of `results.RunResult` (filled in `result_of` and `_extremes_at`), of
`scenes.extremes.Extremes`, and for draws of `ebm.core.extremes`, with its column in
`ebm.extremes`. A batch stops where the outcome is decided, before the block rests.
"""
