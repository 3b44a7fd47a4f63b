"""What a store gives back is what was put into it."""

from dataclasses import replace

import numpy as np

from rockcheck.validation.execute.store import HISTORIES, Store


def test_a_history_that_is_read_back_keeps_the_extremes_of_its_model(made, tmp_path):
    rows = made(np.array([0.0, 0.1, 0.2]))
    extremes = replace(rows.extremes, rotation_left=0.123, hop=0.045, source="model")
    history = replace(rows, model_extremes=extremes)
    Store(tmp_path).put(HISTORIES, "run", {}, history.packed())
    assert Store(tmp_path).load("run").extremes == extremes
