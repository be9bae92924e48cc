"""Recordings of games, which consist of rallies of two sides, read by `faceoff.dataset`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pyarrow")

import faceoff.dataset as fd  # noqa: E402
from dataset_recordings import game, hold  # noqa: E402


def test_rallies_follow_each_other_and_fill_the_game() -> None:
    recording = fd.open_game(game())
    assert recording.agents == ("hold", "hold") and recording.sides == (1, 2)
    assert recording.layout == "faceoff-game/1"
    assert len(recording) == recording.results["rallies"]
    expected = 0
    for number, rally in enumerate(recording):
        assert (rally.index, rally.game_step) == (number, expected)
        motion = rally.table("motion", ["rally", "step"]).to_pylist()
        assert motion == [{"rally": number, "step": step} for step in range(rally.steps)]
        expected += rally.steps
    assert expected == recording.results["steps"] == 1200
    last = recording.rallies[-1]
    goals = [side["goals"] for side in recording.results["sides"]]
    assert last.end == "game_over" and list(last.score) == goals


def test_sides_observe_the_table_from_their_own_end() -> None:
    recording = fd.open_game(game())
    # The x axes of the table and of side 1 point in the same direction.
    for side, direction in ((1, 1), (2, -1)):
        arrays = recording.rallies[0].to_numpy(side)
        steps = recording.rallies[0].steps
        assert arrays.observations.shape == (steps, 23)
        assert arrays.actions.shape == (steps, 2, 7)
        assert arrays.puck.shape == (steps, 6) and arrays.ee.shape == (steps, 3)
        assert set(arrays.effects) <= {"in_time", "late", "fault", "held"}
        asked = ~np.isnan(arrays.computation_time_s)
        answered = ~np.isnan(arrays.actions).any(axis=(1, 2))
        assert (answered <= asked).all() and answered.any()
        # An observation is from the beginning of a step, the true state from its end. The distance between
        # a base and the table's centre is 1.51 m; side 2 observes from the other end.
        observed, true = arrays.observations[1:, 0] - 1.51, arrays.puck[:-1, 0]
        moved = np.abs(observed - direction * true)
        assert np.median(moved) < 0.05


def test_side_file_contains_only_that_side() -> None:
    own = fd.open_game(game() / "side-2.zip")
    assert own.sides == (2,) and own.layout == "faceoff-game-side/1"
    whole = fd.open_game(game())
    side_arrays, whole_arrays = own.rallies[0].to_numpy(2), whole.rallies[0].to_numpy(2)
    assert np.array_equal(side_arrays.observations, whole_arrays.observations)
    with pytest.raises(ValueError, match="side: expected 2, got 1"):
        own.rallies[0].to_numpy(1)
    with pytest.raises(ValueError, match="name: expected one of .*, got 'side-1'"):
        own.table("side-1")


def test_wrong_kind_of_recording_is_refused() -> None:
    with pytest.raises(fd.DatasetError, match="expected the dataset of an evaluation, got a game"):
        fd.open_dataset(game())
    with pytest.raises(fd.DatasetError, match="expected a game, got the dataset"):
        fd.open_game(hold())
    assert isinstance(fd.open(game()), fd.Game)
    fd.open_game(game()).check()


def test_games_convert_to_data_frames(tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    pytest.importorskip("polars")
    recording = fd.open_game(game())
    assert len(recording.to_pandas("motion")) == len(recording.to_polars("side-1")) == 1200
    rally = recording.rallies[0]
    assert len(rally.to_pandas()) == len(rally.to_polars("side-2")) == rally.steps
