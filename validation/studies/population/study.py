"""The assessment of a scene: does it fall, how far does it move, how sure is that?

In: a plan. Out: a finding, that is the answers in words, as tables and plots, and as data. Called
by the command `assess`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rockcheck.validation.criteria import CRITERIA
from rockcheck.validation.finding import Block, Finding
from rockcheck.validation.studies.population import (
    blocks,
    certainty,
    certainty_blocks,
    damage,
    damage_blocks,
    damage_files,
    data,
    level_blocks,
    results,
    search_blocks,
    sentences,
    statistics,
)
from rockcheck.validation.studies.population.gathered import Gathered
from rockcheck.validation.studies.population.plan import Plan
from rockcheck.validation.study import Study, Task
from rockcheck.version import __version__

#: The questions, in the order in which they are answered.
FALL, MOVE, GAP, INTENSITY, SURE, HAND = (
    "Does it fall?",
    "How far does it move?",
    "Which gap is safe?",
    "At which intensity does it fall?",
    "How sure is that?",
    "What do hand methods say?",
)


@dataclass(frozen=True, kw_only=True)
class Assessment(Study):
    """An assessment of a scene."""

    plan: Plan
    name = "assess"
    record = results.Result

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Task]:
        """The runs as they are, and those whose numbers are varied; then the gaps."""
        return self.plan.tasks(done)

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """The answers to the engineer's questions."""
        return finding_of(Gathered(self.plan, done))


def finding_of(gathered: Gathered) -> Finding:
    """All answers: in words, as blocks, and as data."""
    plan, scene = gathered.plan, gathered.plan.own.scene
    falls = statistics.fall_answer(gathered)
    quantities = statistics.quantity_answers(gathered)
    gaps = statistics.gap_answers(gathered)
    intensity = statistics.intensity_answer(gathered)
    uncertainty = certainty.uncertainty_answer(gathered)
    events = [criterion.event for criterion in CRITERIA]
    scores = certainty.method_scores(gathered, [(one.name, one.event) for one in CRITERIA])
    damages = damage.damage_answers(gathered)
    curves = plan.levels.curves(gathered.done) if plan.levels else []

    answers = {
        FALL: sentences.fall_sentences(scene.name, falls, gathered),
        MOVE: sentences.motion_sentences(quantities),
        GAP: sentences.gap_sentences(gaps) or ["It has no wall; --gaps left asks for one."],
        INTENSITY: sentences.intensity_sentences(intensity),
        SURE: sentences.certainty_sentences(gathered, uncertainty),
        HAND: sentences.method_sentences(scores, events),
    }
    answers[INTENSITY] += damage_blocks.damage_sentences(damages)
    for question in (GAP, INTENSITY):
        answers[question] += sentences.edge_sentences(scene)
    if plan.levels:
        answers[INTENSITY].append(level_blocks.sentence_of(plan.levels, curves))
    page: list[Block] = [
        blocks.scene_text(scene, gathered),
        blocks.answer_table(answers),
        blocks.scene_plot(scene),
        blocks.outcome_table(falls),
        blocks.quantity_table(quantities, several=falls.runs > 1),
        *blocks.strip_plot(quantities),
        *(block for answer in gaps for block in search_blocks.gap_blocks(answer, scene)),
        *search_blocks.intensity_blocks(intensity),
        *damage_blocks.damage_blocks(damages),
    ]
    if plan.levels:
        page += level_blocks.blocks_of(plan.levels, curves, gathered.done)
    page += [
        blocks.run_table(gathered),
        *blocks.history_plot(gathered),
        certainty_blocks.contribution_table(uncertainty),
        *certainty_blocks.sensitivity_table(gathered),
        *certainty_blocks.numerical_blocks(gathered),
        *certainty_blocks.threshold_table(gathered),
        *certainty_blocks.model_table(gathered),
        *certainty_blocks.method_blocks(scores),
        *blocks.note_text(gathered),
    ]
    failures = {case: run.reason for case, run in gathered.as_it_is.items() if run.reason}
    return Finding(
        "assess",
        f"Assessment: {scene.name}",
        answers[FALL][0],
        page,
        {
            "scene": scene.name,
            "model": plan.model,
            **(plan.levels.data if plan.levels else {}),
            **data.fall_data(falls),
            **data.quantity_data(quantities),
            **data.gap_data(gaps),
            **data.intensity_data(intensity),
            **damage_blocks.damage_data(damages),
            **data.certainty_data(gathered, uncertainty),
            **data.method_data(scores),
            "left_out": list(plan.left_out),
        },
        exit_code=exit_code_of(gathered, failures),
        failures=failures,
        files={
            blocks.file_of(case): shown.history
            for case, shown in gathered.shown.items()
            if shown.history
        }
        | damage_files.pelicun_files(
            damages, scene, plan.batch_model, __version__, plan.own.building
        ),
    )


def exit_code_of(gathered: Gathered, failures: Mapping[str, str]) -> int:
    """3 where a run failed, 1 where a single run is not converged, else 0."""
    if gathered.failed or failures:
        return 3
    if gathered.plan.recorded or gathered.plan.levels or gathered.own_certainty is None:
        return 0
    return 0 if sentences.is_converged(gathered.own_certainty) else 1
