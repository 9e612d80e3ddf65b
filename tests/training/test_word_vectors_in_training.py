"""Pretrained word vectors: where training begins, and kept out of weights that are trained already."""

import pytest

from a2g_jax.errors import InputError
from a2g_jax.models.base import Model
from a2g_jax.training import loop
from a2g_jax.training.fine_tuning import training_model


class Filled(Exception):
    """The table of word vectors was filled."""


class Begun(Exception):
    """The initial state is complete."""


@pytest.mark.parametrize(("tuned", "expected"), [(False, Filled), (True, Begun)])
def test_trained_word_vectors_of_a_source_stay(tmp_path, toy_corpus, toy_run_config, monkeypatch, tuned, expected):
    def fill(*_) -> None:
        raise Filled

    def begin(*_) -> None:
        raise Begun

    def reading_model(config) -> Model:
        return training_model(config)._replace(use_words=fill)

    monkeypatch.setattr(loop, "training_model", reading_model)
    monkeypatch.setattr(loop, "write_description", begin)
    config = toy_run_config()
    start = loop.init_state(training_model(config), (), 0).params if tuned else None
    with pytest.raises(expected):
        loop.train(config, toy_corpus, tmp_path / "run", resume=False, progress=False, start=start)


@pytest.mark.parametrize("there", [False, True])
def test_a_training_that_is_refused_leaves_no_empty_folder_behind(
    tmp_path, toy_corpus, toy_run_config, monkeypatch, there
):
    def fill(*_) -> None:
        raise InputError("vectors.txt, line 1: has a vector of 3 numbers; expected 4.")

    monkeypatch.setattr(loop, "training_model", lambda config: training_model(config)._replace(use_words=fill))
    out = tmp_path / "run"
    if there:
        out.mkdir()
    with pytest.raises(InputError, match="expected 4"):
        loop.train(toy_run_config(), toy_corpus, out, resume=False, progress=False)
    assert [path.name for path in tmp_path.iterdir()] == ["run"] * there
