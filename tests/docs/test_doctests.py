"""The examples in the docstrings of public names run as they are."""

import doctest
import functools
import inspect

import pytest

import a2g_jax

#: Names that have an example.
EXPECTED = {
    "Generator",
    "LatentSpace",
    "Stream",
    "export",
    "rank_samples",
    "retarget",
    "unusual_speech",
    "write_audio",
    "write_bvh",
    "write_motion_npz",
    "write_page",
}


def examples(name):
    """The examples of a public name and of its methods."""
    owner = getattr(a2g_jax, name)
    found = [(name, inspect.getdoc(owner) or "")]
    if inspect.isclass(owner):
        methods = ((key, value) for key, value in vars(owner).items() if inspect.isfunction(value) and key[0] != "_")
        found += [(f"{name}.{key}", inspect.getdoc(value) or "") for key, value in methods]
    parser = doctest.DocTestParser()
    tests = (parser.get_doctest(text, {}, where, None, 0) for where, text in found)
    return [test for test in tests if test.examples]


ALL = [test for name in sorted(a2g_jax.__all__) if name != "__version__" for test in examples(name)]


@pytest.fixture(scope="module", autouse=True)
def shared_runs():
    """Examples share runs and compiled programs, which each would make anew."""
    from a2g_jax.generation import generator

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(a2g_jax, "demo_run", functools.cache(a2g_jax.demo_run), raising=False)
        patch.setattr(generator, "Engine", functools.cache(generator.Engine))
        yield


def test_names_have_examples():
    assert {test.name.partition(".")[0] for test in ALL} >= EXPECTED


@pytest.mark.parametrize("test", ALL, ids=[test.name for test in ALL])
def test_example(test, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said: list[str] = []
    doctest.DocTestRunner(verbose=False).run(test, out=said.append)
    assert said == [], "".join(said)
