import collections
import datetime
import os
import pathlib
import pickle
import pickletools
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from a2g_jax.errors import InputError
from a2g_jax.io.untrusted import Limits, decode_pickle, read_pickle
from tests.io.fuzz_for_tests import calls_made, damaged, peak_memory
from tests.io.untrusted_checks import NAME, Calls, attempt, payloads, same
from tests.io.untrusted_pickle_values import value as stored_value

PROTOCOLS = range(pickle.HIGHEST_PROTOCOL + 1)
VALUES = [
    *(None, True, False, 0, 255, 256, -1, 2**31, -(2**63), 2**64, 2**2000, 1.5, -0.0, float("inf"), float("nan"), 1j),
    *("", "a'b\n\\ü\U0001f600", b"", b"\x00\xff" * 200, bytearray(b"ab")),
    *(
        [],
        (),
        {},
        set(),
        frozenset({1, "a"}),
        [[]],
        (1,),
        (1, 2),
        (1, 2, 3),
        (1, 2, 3, 4),
        {1: {2: [3]}},
        {(1, "a"): 2},
    ),
    *(np.float32(1.5), np.int64(-3), np.bool_(True), np.complex64(1j), np.str_("é"), np.bytes_(b"a")),
    *(np.arange(6).reshape(2, 3), np.asfortranarray(np.ones((2, 3))), np.arange(12.0).reshape(3, 4)[:, ::2]),
    *(np.zeros((0, 3)), np.array(5), np.array(["ab", "ü"]), np.array([b"a"]), np.arange(3, dtype=">i2")),
    *(np.array([True, False]), np.float16([1, 2]), np.array([1, "a", None, [2]], object), np.dtype("<f4")),
]


class Stateful:
    def __setstate__(self, state):
        raise AssertionError("this ran")


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("value", VALUES, ids=lambda value: type(value).__name__)
def test_what_python_writes_is_read_back(value, protocol):
    found = attempt(decode_pickle, pickle.dumps(value, protocol))
    if isinstance(value, set | frozenset):
        assert found == value
    else:
        assert same(found, value)


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_ordered_dictionaries_become_plain_ones(protocol):
    assert same(attempt(decode_pickle, pickle.dumps(collections.OrderedDict(b=1, a=2), protocol)), {"b": 1, "a": 2})


@pytest.mark.parametrize("name", payloads("pickle"))
def test_pickles_of_old_pythons_are_read(name):
    found = attempt(decode_pickle, payloads("pickle")[name])
    expected = stored_value()
    if name.startswith("python2"):
        expected["words"] = expected["words"].astype("S2")
    expected["order"] = dict(expected["order"])
    assert found.keys() == expected.keys()
    for key, part in expected.items():
        assert same(found[key], part) or found[key] == part == {3}, key


def test_arrays_are_writable_and_their_own():
    twice = [np.arange(3)] * 2
    first, second = decode_pickle(pickle.dumps(twice), NAME)
    first[0] = 7
    assert first is second


REFUSED = {
    "os.system": b"cos\nsystem\n(S'touch CANARY'\ntR.",
    "posix.system": b"\x80\x04\x8c\x05posix\x8c\x06system\x93\x8c\x0ctouch CANARY\x85R.",
    "builtins.eval": b'cbuiltins\neval\n(S\'open("CANARY", "w")\'\ntR.',
    "__builtin__.getattr": b"c__builtin__\ngetattr\n(S'a'\nS'b'\ntR.",
    "subprocess.Popen": b"csubprocess\nPopen\n((lS'touch'\naS'CANARY'\natR.",
    "numpy.load": b"cnumpy\nload\n(S'CANARY'\ntR.",
    "numpy._core.multiarray.fromfile": b"cnumpy._core.multiarray\nfromfile\n(S'CANARY'\ntR.",
    "numpy.f2py.crackfortran.myeval": b"cnumpy.f2py.crackfortran\nmyeval\n(S'1'\ntR.",
    "torch._utils._rebuild_tensor_v2": b"ctorch._utils\n_rebuild_tensor_v2\n.",
    "smplx.body_models.SMPL": b"ccopy_reg\n_reconstructor\n(csmplx.body_models\nSMPL\nc__builtin__\nobject\nNtR.",
    "builtins.object.__reduce_ex__": b"\x80\x04\x8c\x08builtins\x8c\x14object.__reduce_ex__\x93.",
    "functools.partial": b"cfunctools\npartial\n.",
    "collections.Counter": b"ccollections\nCounter\n.",
    "calls copyreg._reconstructor": b"ccopy_reg\n_reconstructor\n(c__builtin__\nobject\nc__builtin__\nobject\nNtR.",
    "calls builtins.object": b"c__builtin__\nobject\n(tR.",
    "calls 'x'": b"S'x'\n(tR.",
    "an instance of a class": b"(ios\nsystem\n.",
    "a persistent id": b"Pstorage\n.",
    "a registered extension": b"\x80\x02\x82\x01.",
    "a buffer kept outside": b"\x80\x05\x97.",
    "sets the state of collections.OrderedDict": b"ccollections\nOrderedDict\n}b.",
    "sets the state of a dict": b"}}b.",
    "a Global where a plain value": b"cnumpy\nndarray\n.",
    "key of type Global": b"}cnumpy\nndarray\nNs.",
    "rebuilds an array of class builtins.object": b"cnumpy.core.multiarray\n_reconstruct\n"
    b"(c__builtin__\nobject\n(I0\ntS'b'\ntR.",
    "arguments that NumPy and Python never write": b"c_codecs\nencode\n(Vx\nVzip\ntR.",
    "numpy.dtype arguments": b"cnumpy\ndtype\n(tR.",
    "array of type 'V8'": b"cnumpy\ndtype\n(S'V8'\ntR.",
    "an array before its content": b"cnumpy.core.multiarray\n_reconstruct\n(cnumpy\nndarray\n(I0\ntS'b'\ntRp0\ng0\n.",
    "holds itself": b"]q\x00h\x00a.",
    "a key of type list": b"}]Ns.",
    "a key beyond 64 bits": pickle.dumps({2**64: 0}),
    "protocol 6": b"\x80\x06N.",
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused_by_name_and_not_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    error = attempt(decode_pickle, REFUSED[name])
    assert isinstance(error, InputError)
    assert name in str(error)
    assert list(tmp_path.iterdir()) == []


def test_pickle_itself_runs_the_payload(tmp_path, monkeypatch):
    # Python's own reader runs what ours refuses, so the test above tests something.
    monkeypatch.chdir(tmp_path)
    pickle.loads(REFUSED["os.system"])  # noqa: S301
    assert (tmp_path / "CANARY").exists()


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_calls_and_states_of_real_pickles_are_refused(protocol, tmp_path):
    canary = tmp_path / "canary"
    for thing, name in (
        (Calls(os.system, f"touch {canary}"), f"{os.system.__module__}.system"),
        (Calls(eval, f"open({str(canary)!r}, 'w')"), "eval"),
        (Calls(np.memmap, str(canary), "u1", "w+", 0, (1,)), "numpy.memmap"),
    ):
        error = attempt(decode_pickle, pickle.dumps(thing, protocol))
        assert name in str(error)
        assert "nothing was run" in str(error)
    stateful = Stateful()
    stateful.x = 1
    assert "Stateful" in str(attempt(decode_pickle, pickle.dumps(stateful, protocol)))
    nested = [np.zeros(2), {"a": Calls(os.mkdir, str(canary)), "b": stateful, "c": 3}]
    found = attempt(decode_pickle, pickle.dumps(nested, protocol))
    assert found[1]["c"] == 3
    for key, name in (("a", "mkdir"), ("b", "Stateful")):
        with pytest.raises(InputError, match=f"{NAME}, byte .*{name}.* nothing was run"):
            np.asarray(found[1][key])
    assert not canary.exists()


class Tensor:
    """Pickles as PyTorch's tensors do: a rebuilding function, storages, hooks and a state."""

    def __reduce__(self):
        return rebuild, (b"storage" * 40, 0, (2, 3), (3, 1), False, collections.OrderedDict()), {"_backward": None}


def rebuild(*_arguments):
    raise AssertionError("this ran")


class Mapping(dict):
    pass


class Listing(list):
    pass


class Slots:
    __slots__ = ("a",)

    def __init__(self):
        self.a = 1


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_what_is_refused_does_not_hinder_the_rest(protocol):
    """Objects of many kinds beside arrays: these are read, those fail when they are used, also where shared."""
    objects = {
        "tensor": Tensor(),
        "mapping": Mapping(a=1),
        "listing": Listing([1, 2]),
        "set": collections.Counter("aab"),
        "class": Tensor,
        "function": rebuild,
        "date": datetime.datetime(2020, 1, 1),
        "path": pathlib.PurePosixPath("a/b"),
        "default": collections.defaultdict(list, a=[1]),
        "records": np.zeros(2, "i4,f4"),
        "matrix": np.zeros((1, 1)).view(np.matrix),
        "masked": np.ma.masked_array([1, 2], [True, False]),
    }
    if protocol >= 2:
        objects["slots"] = Slots()
    poses = np.arange(12.0).reshape(2, 6)
    value = {"before": poses, **objects, "again": dict(objects), "list": [*objects.values(), 5], "after": poses}
    found = attempt(decode_pickle, pickle.dumps(value, protocol))
    np.testing.assert_array_equal(found["before"], poses)
    assert found["after"] is found["before"]
    assert found["list"][-1] == 5
    for key in objects:
        for refused in (found[key], found["again"][key]):
            for use in (len, list, np.asarray, float, bool, lambda x: x["a"], lambda x: x.shape, lambda x: x == 1):
                with pytest.raises(InputError, match=f"{NAME}, byte "):
                    use(refused)


def type_of(text: bytes) -> bytes:
    return b"cnumpy\ndtype\n(S'" + text + b"'\ntR(I3\nS'|'\nNNNI-1\nI-1\nI0\ntb"


REPEATED = {
    "opcodes": b"N0" * 60 + b"N.",
    "sets": b"(" + b"N" * 20 + b"lp0\n0" + b"cbuiltins\nset\n(g0\ntR0" * 5 + b"N.",
    "arrays of objects": type_of(b"O8")
    + b"p1\n0("
    + b"N" * 20
    + b"lp0\n0"
    + b"cnumpy.core.multiarray\n_reconstruct\n(cnumpy\nndarray\n(I0\ntS'b'\ntR(I1\n(I20\ntg1\nI00\ng0\ntb0" * 5
    + b"N.",
    "references": b"(" + b"N" * 20 + b"lp0\n0(" + b"(g0\nl" * 40 + b"l.",
}


@pytest.mark.parametrize("name", REPEATED)
def test_the_number_of_steps_is_bounded(name):
    limits = Limits(steps=90)
    with pytest.raises(InputError, match="takes more than 90 steps to read"):
        decode_pickle(REPEATED[name], NAME, limits)
    decode_pickle(REPEATED[name], NAME, Limits(steps=1000))


def test_memory_is_bounded_by_the_size_of_the_file():
    """A file of a kilobyte cannot make gigabytes of arrays from one string of bytes."""
    block = 2**20
    head = b"B" + struct.pack("<I", block) + bytes(block) + b"q\x000" + type_of(b"u1") + b"q\x010"
    one = b"cnumpy.core.numeric\n_frombuffer\n(h\x00h\x01J" + struct.pack("<i", block) + b"\x85S'C'\ntR"
    assert len(attempt(decode_pickle, head + b"(" + one * 3 + b"l.")) == 3
    with pytest.raises(InputError, match="bytes of memory"):
        decode_pickle(head + b"(" + one * 600 + b"l.", NAME)


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize(
    "array",
    [np.zeros(2, "i4,f4"), np.array(["2020"], "M8[D]"), np.array([1], "m8[s]"), np.zeros(1, "V3"), np.zeros(1, "g")],
    ids=lambda array: array.dtype.str,
)
def test_records_dates_and_the_like_are_refused(array, protocol):
    assert "expected plain numbers or text" in str(attempt(decode_pickle, pickle.dumps(array, protocol)))


def test_matrices_and_masked_arrays_are_refused_by_class():
    masked = np.ma.masked_array([1, 2], [True, False])
    assert "numpy.ma" in str(attempt(decode_pickle, pickle.dumps(masked)))
    matrix = np.zeros((1, 1)).view(np.matrix)
    assert "matrix" in str(attempt(decode_pickle, pickle.dumps(matrix)))


def laughs(levels: int, opcode: bytes = b"\x86") -> bytes:
    """Pairs of pairs of pairs ..., each part of which is the same one, from the memo."""
    return b"\x80\x02K\x00" + b"".join(b"q\x00h\x00" + opcode for _ in range(levels)) + b"."


def test_few_bytes_that_stand_for_many_values_are_refused():
    assert attempt(decode_pickle, laughs(10)) != 0
    assert "written out" in str(attempt(decode_pickle, laughs(40)))
    wide = b"]q\x00(" + b"h\x00" * 5 + b"e."
    assert "holds itself" in str(attempt(decode_pickle, wide))
    deep = b"]" * 60 + b"a" * 59 + b"."
    assert "50 levels deep" in str(attempt(decode_pickle, deep))
    assert "50 levels deep" in str(attempt(decode_pickle, b"]" * 2000 + b"a" * 1999 + b"."))


CLAIMS = {
    "bytes": b"\x8e" + struct.pack("<Q", 2**62) + b"abc.",
    "text": b"\x8d" + struct.pack("<Q", 2**62) + b"abc.",
    "bytearray": b"\x96" + struct.pack("<Q", 2**40) + b"abc.",
    "old bytes": b"T" + struct.pack("<i", -1) + b".",
    "integer": b"\x8b" + struct.pack("<i", 2**31 - 1) + b".",
    "negative integer": b"\x8b" + struct.pack("<i", -5) + b".",
    "frame": b"\x95" + struct.pack("<Q", 2**63) + b"N.",
    "decimal": b"L" + b"9" * 5000 + b"L\n.",
    "memo": b"Nr\xff\xff\xff\xff0j\xff\xff\xff\xff.",
    "line": b"c" + b"a" * 5000 + b"\n",
    "array": b"cnumpy.core.multiarray\n_reconstruct\n(cnumpy\nndarray\n(I0\ntS'b'\ntR(I1\n(L99999999999L\n"
    b"tcnumpy\ndtype\n(S'f8'\ntRI00\nS''\ntb.",
    "wide text": b"cnumpy\ndtype\n(S'U999999999'\ntR.",
}


@pytest.mark.parametrize("name", CLAIMS)
def test_claimed_sizes_are_not_trusted(name):
    attempt(decode_pickle, CLAIMS[name])
    assert peak_memory(decode_pickle, CLAIMS[name], NAME) < 60_000


def test_memory_stays_within_the_limit():
    limits = Limits(size=2**17)
    for data in (
        b"(" + b"N" * 10**4 + b"t.",
        b"]" + b"]a" * 3000 + b".",
        b"}" + b"".join(b"J" + struct.pack("<i", n) + b"Ns" for n in range(3000)) + b".",
        b"(" * 3000,
        pickle.dumps(np.zeros(2**18, np.uint8)),
        pickle.dumps("a" * 2**20 + "\U0001f600"),
        pickle.dumps(b"a" * 2**20, 0),
        b"N" + b"".join(b"r" + struct.pack("<I", n * 2**16) for n in range(3000)) + b".",
    ):
        with pytest.raises(InputError, match="would take more than 131072 bytes"):
            decode_pickle(data, NAME, limits)
        assert peak_memory(decode_pickle, data, NAME, limits) < 3 * limits.size + len(data)


def test_tuples_as_keys_cannot_be_made_to_collide_for_long():
    keys = b"".join(b"K\x01J" + struct.pack("<i", n) + b"\x86r" + struct.pack("<I", n) + b"0" for n in range(600))
    one = b"}(" + b"".join(b"j" + struct.pack("<I", n) + b"N" for n in range(600)) + b"u"
    limits = Limits(size=2**23)
    assert len(decode_pickle(keys + one + b".", NAME, limits)) == 600
    with pytest.raises(InputError, match="would take more"):
        decode_pickle(keys + b"]" + (one + b"a") * 3 + b".", NAME, limits)
    many = b"}(" + b"".join(b"J" + struct.pack("<i", n) + b"\x85N" for n in range(4200)) + b"u."
    assert "too many or too long tuples" in str(attempt(decode_pickle, many))


def test_leftovers_and_missing_parts_are_damage():
    whole = pickle.dumps({"a": [1, 2], "b": np.arange(4)})
    for cut in range(len(whole)):
        assert "damaged" in str(attempt(decode_pickle, whole[:cut]))
    assert "3 bytes follow" in str(attempt(decode_pickle, whole + b"abc"))
    assert "left over" in str(attempt(decode_pickle, b"NN."))
    assert "no pickle has an opcode 0xff" in str(attempt(decode_pickle, b"\xff"))


def test_every_opcode_of_python_is_read_or_refused_by_name():
    for opcode in pickletools.opcodes:
        message = str(attempt(decode_pickle, b"\x80\x02((" + opcode.code.encode("latin-1") + b"0\n0\n"))
        assert "is unknown" not in message


def test_numbers_are_bounded_in_their_messages_too():
    assert "recalls value a number beyond 64 bits" in str(attempt(decode_pickle, b"g" + b"9" * 1000 + b"\n."))


def test_files(tmp_path):
    path = tmp_path / "a.pkl"
    with pytest.raises(InputError, match="no such file"):
        read_pickle(path)
    path.write_bytes(pickle.dumps([1]))
    assert read_pickle(path) == [1]
    with pytest.raises(InputError, match="more than 4 bytes of memory"):
        read_pickle(path, Limits(size=4))


WHOLES = [*payloads("pickle").values(), *(pickle.dumps(VALUES, protocol) for protocol in (2, 4, 5))]
BITS = [
    bytes([n]) for n in b"().0122IJKLMNTUVXbadegjlpqrstu]}\x80\x85\x86\x87\x88\x8a\x8c\x8f\x90\x91\x93\x94\x95C"
] + [
    *(b"\x01", b"\x00\x00\x00\x00", b"\x04", b"1\n", b"S'a'\n", b"cnumpy\ndtype\n", b"cnumpy\nndarray\n", b"S'f8'\n"),
    *(
        b"cnumpy.core.multiarray\n_reconstruct\n",
        b"cnumpy.core.multiarray\nscalar\n",
        b"R",
        b"b",
        b"c_codecs\nencode\n",
    ),
    *(
        b"cbuiltins\nset\n",
        b"cbuiltins\nbytearray\n",
        b"ccollections\nOrderedDict\n",
        b"cos\nsystem\n",
        b"(I0\ntS'b'\ntR",
    ),
]


@settings(max_examples=40, deadline=None)
@given(data=damaged(WHOLES))
def test_damaged_pickles(data):
    attempt(decode_pickle, data)


@settings(max_examples=100, deadline=None)
@given(data=st.lists(st.sampled_from(BITS), max_size=40).map(b"".join), end=st.booleans())
def test_programs_of_random_opcodes(data, end):
    attempt(decode_pickle, data + b"." * end)


@settings(max_examples=60, deadline=None)
@given(data=st.one_of(damaged(WHOLES), st.lists(st.sampled_from(BITS), max_size=60).map(b"".join)))
def test_damage_costs_no_more_than_its_length(data):
    limits = Limits(size=2**18)
    assert peak_memory(decode_pickle, data, NAME, limits) < 3 * limits.size
    assert calls_made(decode_pickle, data, NAME, limits) < 20_000 + 500 * len(
        data
    )  # the checks of types that tests add make most of them
