import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from a2g_jax.errors import InputError
from a2g_jax.io.untrusted import Limits, decode_arrow
from tests.io import untrusted_arrow_values as stored
from tests.io.flat_for_tests import Structs, Table, Tables, flat
from tests.io.fuzz_for_tests import calls_made, damaged, peak_memory
from tests.io.untrusted_checks import NAME, attempt, payloads, same
from tests.io.untrusted_writers import arrow_payload

STORED = payloads("arrow")
KINDS = "bBhHiIqQefd"


def as_read(name):
    """What the value of a stored payload becomes: collections plain, float32 a float as with pyarrow itself."""
    value = stored.values(bytes)[name]
    if name == "collections":
        return [dict(value[0]), list(value[1]), dict(value[2])]
    return value


@pytest.mark.parametrize("name", STORED)
def test_what_pyarrow_wrote_is_read_back(name):
    found, expected = attempt(decode_arrow, STORED[name]), as_read(name.split("-")[1])
    if name.endswith("-arrays"):
        # pyarrow makes NumPy's scalars Python's, but for float16.
        found, scalars, expected = found[:-5], found[-5:], expected[:-5]
        assert scalars == [2.5, 1.5, 3.0, 4, True]
        assert type(scalars[1]) is np.float16
    if name.endswith("-atoms"):
        assert found[-2] == expected[-2] == {1, 2}
        found, expected = [*found[:-2], found[-1]], [*expected[:-2], expected[-1]]
    assert same(found, expected)


@pytest.mark.parametrize("name", ["ted", "none", "buffers"])
def test_our_writer_stands_for_what_pyarrow_wrote(name):
    ours = decode_arrow(arrow_payload(stored.values(memoryview)[name]), NAME)
    assert same(ours, decode_arrow(STORED[f"0.17.1-{name}"], NAME))


atoms = st.one_of(
    st.none(), st.booleans(), st.integers(-(2**63), 2**63 - 1), st.floats(), st.text(max_size=5), st.binary(max_size=5)
)
shapes = st.lists(st.integers(0, 3), max_size=3).map(tuple)
arrays = st.builds(
    lambda shape, kind: np.arange(np.prod(shape)).astype(kind).reshape(shape), shapes, st.sampled_from(KINDS)
)
keys = st.one_of(st.text(max_size=3), st.integers(-9, 9))
values = st.recursive(
    st.one_of(atoms, arrays),
    lambda inner: st.one_of(
        st.lists(inner, max_size=4), st.lists(inner, max_size=3).map(tuple), st.dictionaries(keys, inner, max_size=3)
    ),
    max_leaves=12,
)


@settings(max_examples=40, deadline=None)
@given(value=values)
def test_round_trip(value):
    assert same(attempt(decode_arrow, arrow_payload(value)), value)


def test_large_values_keep_their_order():
    value = {"a": list(range(3000)), "b": [{"x": float(n), "y": np.full(3, n)} for n in range(100)]}
    assert same(decode_arrow(arrow_payload(value), NAME), value)


def marked(kind, data, **more):
    """What pyarrow's handlers write for a type without an Arrow type."""
    return arrow_payload({"_pytype_": kind, "data": data, **more})


REFUSED = {
    "os.system": marked("x", b"cos\nsystem\n(S'touch CANARY'\ntR.", pickle=True),
    "__main__.Custom": marked("__main__.Custom", {"a": 1}),
    "builtins.type": marked("builtins.type", "os"),
    "function": marked("function", b"abc"),
    "an unknown type": marked([1], 1),
    "'int'": marked("int", "1e5"),
    "collections.OrderedDict": marked("collections.OrderedDict", [[1], []]),
    "torch.Tensor": marked("torch.Tensor", [np.zeros(2), "cpu"]),
    "array of type '|V8'": marked("np.array", [[1], "|V8"]),
    "elements do not fit": marked("np.array", [["a", 1], "<U1"]),
    "elements do not fit its": marked("np.array", [[[1], [2, 3]], "<i4"]),
    "bytes do not fit": marked("np.array", [np.zeros(3, np.uint8), "<i4"]),
    "a key of type list": marked("collections.OrderedDict", [[[1]], [1]]),
    "too many or too long": arrow_payload({tuple(range(99)): 1}),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused_by_name_and_not_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    error = attempt(decode_arrow, REFUSED[name])
    assert isinstance(error, InputError)
    assert name in str(error)
    assert list(tmp_path.iterdir()) == []


def test_lists_that_stand_for_arrays():
    found = decode_arrow(marked("np.array", [[[1, 2], [3, 4]], "<i2"]), NAME)
    assert same(found, np.array([[1, 2], [3, 4]], "<i2"))
    found = decode_arrow(marked("np.array", [[True, False], "|b1"]), NAME)
    assert same(found, np.array([True, False]))
    assert "OverflowError" in str(attempt(decode_arrow, marked("np.array", [[2**40], "<i2"])))


def test_tensors_of_pyarrow_and_sparse_ones_are_refused():
    whole = bytearray(arrow_payload([1]))
    for place, name in ((0, "pyarrow tensors"), (1, "sparse tensors")):
        counts = [0, 0, 0, 0]
        counts[place] = 1
        counts[3] = place
        whole[:16] = struct.pack("<4i", *counts)
        assert name in str(attempt(decode_arrow, bytes(whole)))


def test_depth():
    deep = 1
    for _ in range(60):
        deep = [deep]
    assert "nested more than 50" in str(attempt(decode_arrow, arrow_payload(deep)))


def test_elements_that_share_one_child_cost_each_time():
    # The first column of increasing numbers holds the bounds of the lists: make all of them the first, long one.
    value = [list(range(50)), *([n] for n in range(300))]
    whole = arrow_payload(value)
    rising = np.arange(301, dtype="<i4").tobytes()
    repeated = whole.replace(rising, bytes(len(rising)), 1)
    assert len(decode_arrow(repeated, NAME)[300]) == 50
    with pytest.raises(InputError, match="would take more than"):
        decode_arrow(repeated, NAME, Limits(size=2**19))
    assert peak_memory(decode_arrow, repeated, NAME, Limits(size=2**19)) < 2**20


def test_metadata_cannot_point_at_the_same_thing_for_ever():
    # A schema in which every level has eight times the same child: the columns run out first.
    field = Table(("item", ("B", 1), ("B", 14), Table((("h", 1), Structs("i", []))), None, Tables([])))
    raw = flat(Table((("h", 3), ("B", 1), Table((("h", 0), Tables([field] * 5000))), ("q", 0))))
    whole = bytes(16) + b"\xff\xff\xff\xff" + struct.pack("<I", len(raw)) + raw
    assert isinstance(attempt(decode_arrow, whole), InputError)
    named = Table(("9" * 5000, ("B", 1), ("B", 2), Table((("i", 64), ("B", 1))), None, Tables([])))
    union = Table(("list", ("B", 1), ("B", 14), Table((("h", 1), Structs("i", [(0,)]))), None, Tables([named])))
    raw = flat(Table((("h", 3), ("B", 1), Table((("h", 0), Tables([union]))), ("q", 0))))
    head, batch = bytes(16), arrow_payload([])
    at = 16 + 8 + struct.unpack_from("<I", batch, 20)[0]
    whole = head + b"\xff\xff\xff\xff" + struct.pack("<I", len(raw)) + raw + batch[at:]
    assert "a name of 5000 bytes" in str(attempt(decode_arrow, whole))


def test_cut_short():
    whole = STORED["0.14.1-ted"]
    for cut in range(0, len(whole) - 64, 97):
        assert isinstance(attempt(decode_arrow, whole[:cut]), InputError)


def test_limit():
    whole = arrow_payload([np.zeros(10_000)])
    decode_arrow(whole, NAME, Limits(size=2**20))
    for size in (10, 1000, 100_000):
        with pytest.raises(InputError, match=f"would take more than {size} bytes"):
            decode_arrow(whole, NAME, Limits(size=size))


WHOLES = list(STORED.values())


@settings(max_examples=100, deadline=None)
@given(data=damaged(WHOLES))
def test_damaged_payloads(data):
    attempt(decode_arrow, data)


@settings(max_examples=40, deadline=None)
@given(data=damaged([data for data in WHOLES if len(data) < 2000]))
def test_damage_costs_no_more_than_the_limit(data):
    limits = Limits(size=2**17)
    assert peak_memory(decode_arrow, data, NAME, limits) < 4 * limits.size
    assert calls_made(decode_arrow, data, NAME, limits) < limits.size
