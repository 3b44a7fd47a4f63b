"""A finished run made up without any model: closed-form motions, checks of every verdict, a failed
cell, hostile names."""

import math

import numpy as np
import pytest

from rockcheck.scenes import PAPER_BLOCK, Cost, Event, Floor, Ricker, Scene, Wall, observation
from rockcheck.validation.discrepancy import ensemble, figures, measures
from rockcheck.validation.discrepancy.compare import evaluate
from rockcheck.validation.execute.store import HISTORIES
from rockcheck.validation.suite import results

NASTY = "<img src=x onerror=alert(1)>&\"'</script>"
MODELS = {
    "ebm-unilateral": {"pivot": "unilateral", "tolerance": 1e-10},
    "ebm": {"pivot": "bilateral", "tolerance": 1e-10},
    "cm": {"stiffness": 9e6},
    "mujoco": {"time_step": 1e-4},
    "pybullet": {"time_step": 1e-4},
    "mine:Model": {"note": NASTY},
}


def scene(name: str, wall: bool, duration: float = 12.0) -> Scene:
    return Scene(
        name=name,
        block=PAPER_BLOCK,
        floor=Floor(friction=0.3),
        walls=(Wall(side="left", gap=0.053, restitution=0.5),) if wall else (),
        excitation=Ricker(amplitude=6.0, period=1.0),
        duration=duration,
        description=f"a made-up scene {NASTY}",
    )


def motion(scene, model, delay, *, falls=False):
    """A decaying rocking motion about pivots that stand still, `delay` s late; hops a little beside
    a wall."""
    block, late = scene.block, np.maximum(scene.output_times - delay, 0.0)
    if falls:
        late = late[late < 6.0]
        theta = 0.02 * np.sinh(0.78 * late)
    else:
        theta = 0.3 * block.alpha * np.exp(-0.15 * late) * np.sin(3.0 * late)
    rate = np.gradient(theta, scene.output_step)
    pivot = np.where(theta < 0, -1.0, 1.0)
    s, c = np.sin(block.alpha - np.abs(theta)), np.cos(block.alpha - np.abs(theta))
    slip_rate = 0.004 * np.exp(-0.2 * late) * np.sin(0.7 * late)
    x = pivot * (block.radius * s - block.half_width) + np.cumsum(slip_rate) * scene.output_step
    hop = (
        0.004 * np.maximum(0.0, np.sin(3.0 * late)) ** 8 if scene.walls and model != "ebm" else 0.0
    )
    state = np.column_stack(
        [
            x,
            block.radius * c + hop,
            theta,
            slip_rate - block.radius * c * rate,
            pivot * block.radius * s * rate,
            rate,
        ]
    )
    zeros = [k * math.pi / 3.0 + delay for k in range(1, 11)]
    modes = {"mode_before": "rock", "mode_after": "rock"}
    slides = {"mode_before": "rock", "mode_after": "slide-rock"}
    events = [
        *(Event(t=t, kind="floor impact", impulse=0.4 / (1 + t), **modes) for t in zeros),
        *(
            Event(t=t + 0.4, kind="wall impact", impulse=0.2, **slides)
            for t in zeros[1::2] * bool(scene.walls)
        ),
        *[Event(t=float(late[-1]), kind="overturned left")] * falls,
    ]
    return observation.observe(
        scene,
        model,
        state,
        events=sorted(events, key=lambda e: e.t),
        cost=Cost(wall_seconds=0.01 * (1 + 10 * delay), set_up=0.1, steps=1000, evaluations=4000),
        settings=MODELS[model],
    )


def figure(measure, value, unit="alpha", **more):
    return figures.Figure(
        measure=measure, label=measure.replace("_", " "), unit=unit, value=value, **more
    )


def cell_of(folder, scene, model, delay, falls=False):
    """Play, save and judge a cell: the limits are such that late models fail or change."""
    history = motion(scene, model, delay, falls=falls)
    path = f"{HISTORIES}/{scene.name.replace(' ', '_')}--{model.replace(':', '_')}--0.csv"
    (folder / HISTORIES).mkdir(parents=True, exist_ok=True)
    history.save(folder / path)
    checks = [
        results.Check(
            figure=figure("peak_rotation", history.peak_rotation, until=8.0, window="8s"),
            kind="absolute",
            verdict="pass",
            ideal=history.peak_rotation,
            expected=history.peak_rotation,
            limit=1e-3,
            why="as accepted",
        )
    ]
    figures = [figure("highest_hop", 0.004, "m")]
    value = 0.3 * delay
    for against in (one for one in ("ebm-unilateral", "ebm") if one != model):
        verdict = "pass" if value < 0.8e-3 else "changed" if value < 2e-3 else "fail"
        checks.append(
            results.Check(
                figure=figure("theta_rms", value, against=against, window="8s", until=8.0),
                kind="model form" if against == "ebm" and scene.walls else "numerical",
                verdict=verdict,
                reason={"pass": "", "changed": "0.0015 was 0.0001"}.get(
                    verdict, f"{value:.3g} is more than 0.002 {NASTY}"
                ),
                ideal=0.0,
                expected=1e-4,
                limit=2e-3,
                drift=5e-4,
                why="first-order step error",
            )
        )
        figures += [
            checks[-1].figure,
            figure(
                "events_agree_until",
                12.0 - 100 * delay,
                "s",
                against=against,
                note="floor impact only in " + model,
            ),
            figure("theta_rms", value, against=against, window="horizon", until=10.0),
        ]
    return results.Cell(
        scene=scene.name,
        model=model,
        settings=MODELS[model],
        key="0",
        status="done",
        history=path,
        outcome=history.outcome,
        notes=history.notes,
        cost=results.CostRecord(**vars(history.cost), worker_seconds=0.5),
        figures=tuple(figures),
        checks=tuple(checks),
    )


DELAYS = {
    "ebm-unilateral": 0.0,
    "ebm": 0.0005,
    "cm": 0.001,
    "mujoco": 0.002,
    "pybullet": 0.005,
    "mine:Model": 0.02,
}


def crowd(scatter: float) -> tuple[results.EnsembleRecord, list[results.Cell]]:
    """An ensemble of 40 scenes by three models: peaks from 0.02 to 2 alpha, the largest fall; one
    scatters, one has failed."""
    peaks = np.geomspace(0.02, 2.0, 40)
    other = peaks * np.exp(scatter * np.sin(np.arange(40.0)))
    samples = {
        model: ensemble.Sample(
            values, tuple("overturned left" if value > 1.0 else "at rest" for value in values)
        )
        for model, values in (("ebm-unilateral", peaks), ("cm", other))
    }
    record = results.EnsembleRecord(
        name="crowd",
        description=f"made up {NASTY}",
        definition={
            "name": "crowd",
            "count": 40,
            "friction": {"uniform": [0.3, 0.8]},
            "pulse": {"period": {"uniform": [0.4, 1.5]}, "amplitude": {"lognormal": [6.0, 0.4]}},
            "scene": {
                "duration": 6.0,
                "block": {"half_width": 0.4, "half_height": 1.5},
                "floor": {"friction": 0.5},
            },
        },
        peaks={model: tuple(map(float, sample.peaks)) for model, sample in samples.items()}
        | {"mujoco": (None,) * 40},
        outcomes={model: tuple(sample.outcomes) for model, sample in samples.items()}
        | {"mujoco": (NASTY,) * 40},
    )
    pair = ensemble.Samples(samples["ebm-unilateral"], samples["cm"])
    figures = tuple(
        evaluate(measure, pair, "alpha", against="ebm-unilateral")
        for measure in measures.STATISTICS.values()
    )
    return record, [
        results.Cell(
            scene="crowd", model="ebm-unilateral", status="done", outcome="6 of 40 overturned"
        ),
        results.Cell(
            scene="crowd",
            model="cm",
            status="done",
            outcome="6 of 40 overturned",
            cost=results.CostRecord(wall_seconds=7.25, cpu_seconds=0.5),
            figures=figures,
            checks=(
                results.Check(
                    figure=figures[0],
                    kind="numerical",
                    verdict="pass",
                    ideal=0.0,
                    expected=0.0,
                    limit=0.5,
                    drift=0.5,
                    why="made up",
                ),
            ),
        ),
        results.Cell(
            scene="crowd", model="mujoco", status="failed", reason=f"40 of 40 scenes failed {NASTY}"
        ),
    ]


def make_run(folder, duration=12.0):
    """Write a finished run of three scenes into `folder`: one passes, one fails, one has failed
    cells and a falling block."""
    scenes = [
        scene("free", False, duration),
        scene("beside a wall", True, duration),
        scene("Free", False, duration),
    ]
    late = {"cm": 0.5 * DELAYS["cm"], "mujoco": 0.5 * DELAYS["mujoco"]}
    ensemble, of_ensemble = crowd(0.2)
    cells = (
        *(cell_of(folder, scenes[0], model, late.get(model, 0.0)) for model in list(MODELS)[:5]),
        *(cell_of(folder, scenes[1], model, delay) for model, delay in DELAYS.items()),
        *(
            cell_of(folder, scenes[2], model, DELAYS[model], falls=True)
            for model in ("ebm-unilateral", "ebm")
        ),
        results.Cell(
            scene="Free", model="mujoco", status="failed", reason=f"blew up at 3.2 s {NASTY}"
        ),
        *of_ensemble,
    )
    run = results.Run(
        suite="made-up",
        description=f"for the tests {NASTY}",
        created="2026-01-01T00:00:00+00:00",
        reference="ebm-unilateral",
        model_form="ebm",
        scenes={s.name: s.model_dump(mode="json") for s in scenes},
        models=tuple(MODELS),
        printed=("free", "beside a wall"),  # "Free" is a page without figures for print
        cells=cells,
        ensembles=(ensemble,),
        faults=("tolerance [old.cm.ebm: theta_rms] has no cell in the suite",),
        measures=(
            {
                "name": "theta_rms",
                "label": "RMS difference of rotation",
                "unit": "angle",
                "formula": "sqrt <d^2> of theta, in alpha.",
                "source": "",
            },
        ),
        versions={"rockcheck": "0.1.0", "python": "3.11", "mujoco": "4.0.0"},
        hardware={"processor": f"made up {NASTY}", "cores": "2"},
        wall_seconds=3.0,
    )
    run.save(folder)
    return run


@pytest.fixture
def finished(tmp_path, request):
    """A finished run in `tmp_path`, for tests that change it; a parameter is how long its scenes
    are (s)."""
    return make_run(tmp_path, getattr(request, "param", 12.0))


@pytest.fixture(scope="session")
def site(tmp_path_factory):
    from rockcheck.reports.site import write_site

    folder = tmp_path_factory.mktemp("site")
    make_run(folder)
    write_site(folder)
    for name in ("checks.csv", "figures.csv"):  # validation writes them beside the pages
        (folder / name).touch()
    return folder


@pytest.fixture(scope="session")
def run(site):
    return results.Run.load(site)


@pytest.fixture(scope="session")
def index(site):
    return (site / "index.html").read_text("utf-8")


@pytest.fixture
def opened(visitor):
    """`opened(path, home, **settings)` is a page of the folder `home` in the browser, its data
    unpacked; in the end it must have complained of nothing and asked for nothing elsewhere."""

    def page_at(path, home=None, **settings):
        page = visitor(
            home or path.parent, **{"viewport": {"width": 1280, "height": 900}} | settings
        )
        page.goto(path.as_uri())
        until(page, "!window.rockcheck || !!window.rockcheckPage")
        return page

    return page_at


def until(page, expression, seconds=10.0):
    """Wait for an expression to hold; the pages' policy forbids what playwright's own waiting
    does."""
    for _ in range(int(seconds / 0.05)):
        if page.evaluate(expression):
            return
        page.wait_for_timeout(50)
    raise AssertionError(f"never came true: {expression}")


@pytest.fixture
def eventually():
    return until


@pytest.fixture
def barriers():
    """`barriers(page)`: what keeps people from reading a page, all its details open."""
    from axe_playwright_python.sync_playwright import Axe

    def found(page):
        page.eval_on_selector_all("details", "all => all.forEach(one => { one.open = true; })")
        # By default it would ask for style sheets, which a file may not.
        return [
            f"{v['id']}: {n['html'][:120]}"
            for v in Axe().run(page, options={"preload": False}).response["violations"]
            if v["impact"] in ("serious", "critical")
            for n in v["nodes"][:3]
        ]

    return found
