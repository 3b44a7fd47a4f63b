"""Pelicun reads the curves of an assessment, and damages as many components as they say."""

import csv
import io

import numpy as np
import pytest
from damaged import library
from scipy import stats

pytestmark = pytest.mark.needs("pelicun")
COUNT = 2000


def damaged_share(path, component, intensity):
    """The share of components on storey 1 that Pelicun has damaged, at a floor acceleration (g)."""
    import pandas as pd
    from pelicun import assessment

    model = assessment.Assessment({"PrintLog": False, "Seed": 1})
    model.stories = 1
    demand = pd.DataFrame(
        {"1-PFA-0-1": ["g", *[intensity] * COUNT]}, index=["Units", *range(COUNT)]
    )
    model.demand.load_sample(demand)
    given = {"Units": "ea", "Location": "1", "Direction": "1", "Theta_0": "1", "Blocks": "1"}
    model.asset.load_cmp_model(
        {"marginals": pd.DataFrame(given | {"Family": ""}, index=[component])}
    )
    model.asset.generate_cmp_sample(COUNT)
    model.damage.load_model_parameters([str(path)], {component})
    model.damage.calculate()
    sample = model.damage.save_sample()
    return float(np.mean(sample[(component, "1", "1", "0", "1")].to_numpy(dtype=float)))


def test_pelicun_s_damage_is_that_of_the_curve(tmp_path):
    text = library("pfa")[0]["fragility_pelicun.csv"]
    path = tmp_path / "fragility_pelicun.csv"
    path.write_text(text, "utf-8")
    row = next(iter(csv.DictReader(io.StringIO(text))))
    median, dispersion = float(row["LS1-Theta_0"]), float(row["LS1-Theta_1"])
    for part in (0.05, 0.25, 0.5, 0.75, 0.95):
        intensity = median * np.exp(dispersion * stats.norm.ppf(part))
        low, high = stats.binom.interval(0.95, COUNT, part)
        found = COUNT * damaged_share(path, row["ID"], float(intensity))
        assert low <= found <= high, part
