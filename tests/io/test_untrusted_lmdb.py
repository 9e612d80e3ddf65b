import struct

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from a2g_jax.errors import InputError
from a2g_jax.io.untrusted import Limits, LmdbFile
from tests.io.fuzz_for_tests import calls_made, damaged, peak_memory
from tests.io.untrusted_checks import check_message, payloads
from tests.io.untrusted_lmdb_values import entries
from tests.io.untrusted_writers import write_lmdb

STORED = payloads("lmdb")["data.mdb"]
EXPECTED = entries(payloads("arrow")["0.14.1-ted"])
PAGE = 4096
SMALL = {b"%03d" % n: b"x" * (n % 50) if n != 7 else b"y" * 9000 for n in range(200)}
_NODE = struct.Struct("<HHHH")


def contents(path, limits=None):
    with LmdbFile(path, limits) as database:
        return dict(database.items())


@pytest.fixture
def small(tmp_path):
    """A database of four pages of leaves, and a function that writes it with bytes changed."""
    path = write_lmdb(tmp_path / "db", SMALL)
    whole = path.read_bytes()

    def change(**at_bytes):
        data = bytearray(whole)
        for place, new in at_bytes.items():
            at = int(place.removeprefix("at"))
            data[at : at + len(new)] = new
        path.write_bytes(data)
        return path

    return change


def root_of(path) -> int:
    return struct.unpack_from("<Q", path.read_bytes(), PAGE + 16 + 24 + 48 + 40)[0]


def test_what_lmdb_wrote_is_read_back(tmp_path):
    (tmp_path / "data.mdb").write_bytes(STORED)
    with LmdbFile(tmp_path) as database:
        found = list(database.items())
        assert dict(found) == EXPECTED
        assert [key for key, _ in found] == sorted(EXPECTED) == list(database.keys())
        assert len(database) == len(EXPECTED)
        for key, value in EXPECTED.items():
            assert database.get(key) == value
        assert database.get(b"0000000001") is None
        assert database.get(b"zzz") is None
        assert [key for key, _ in database.items(b"0000000150")] == sorted(EXPECTED)[75:]
    assert contents(tmp_path / "data.mdb") == EXPECTED
    with pytest.raises(InputError, match="is closed"):
        database.get(b"0000000000")


@pytest.mark.parametrize("count", [0, 1, 2, 80, 3000, 30_000])
def test_databases_of_any_depth(count, tmp_path):
    values = {b"%010d" % n: b"v%d" % n * (n % 7) for n in range(count)}
    write_lmdb(tmp_path, values)
    assert contents(tmp_path) == values


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    values=st.dictionaries(st.binary(min_size=1, max_size=60), st.binary(max_size=300), max_size=60),
    sizes=st.lists(st.integers(1900, 20_000), max_size=3),
    page_size=st.sampled_from([512, 4096, 65536]),
)
def test_round_trip(values, sizes, page_size, tmp_path):
    values |= {b"large%d" % n: b"z" * size for n, size in enumerate(sizes)}
    write_lmdb(tmp_path, values, page_size)
    assert contents(tmp_path) == values


def test_what_is_no_database(tmp_path):
    with pytest.raises(InputError, match=r"data\.mdb: there is no such file"):
        LmdbFile(tmp_path)
    path = tmp_path / "data.mdb"
    for data in (b"abc", bytes(PAGE), STORED[:40], b"\0" * 16 + b"\xbe\xef\xc0\xde"):
        path.write_bytes(data)
        with pytest.raises(InputError, match="is not an LMDB database"):
            LmdbFile(path)


@pytest.mark.parametrize(("flag", "name"), [(2, "MDB_REVERSEKEY"), (4, "MDB_DUPSORT"), (8, "MDB_INTEGERKEY")])
def test_other_orders_and_several_values_are_refused_by_name(flag, name, small):
    path = small(**{f"at{PAGE + 16 + 24 + 48 + 4}": struct.pack("<H", flag)})
    with pytest.raises(InputError, match=name):
        LmdbFile(path)


def test_named_databases_are_refused(small):
    path = small()
    leaf = path.read_bytes().index(b"\x02\0\0\0\0\0\0\0", PAGE * 2)  # the first page that is not a start page
    assert leaf == PAGE * 2 or leaf % PAGE == 0
    data = path.read_bytes()
    page = next(n for n in range(2, len(data) // PAGE) if data[n * PAGE + 10] == 2)
    node = struct.unpack_from("<H", data, page * PAGE + 16)[0]
    with pytest.raises(InputError, match="several values under one key"):
        contents(small(**{f"at{page * PAGE + node + 4}": b"\x02"}))


def test_pages_that_go_in_circles(small):
    path = small()
    data = path.read_bytes()
    root = root_of(path) * PAGE
    first, second = struct.unpack_from("<HH", data, root + 16)
    for own in (root // PAGE, 0, 1, 2**40):  # the root itself, a start page, and one far off
        with pytest.raises(InputError, match=r"page \d+ is damaged"):
            contents(small(**{f"at{root + first}": _NODE.pack(own & 0xFFFF, own >> 16 & 0xFFFF, own >> 32, 0)}))
    again = data[root + first : root + first + 6]
    with pytest.raises(InputError, match="its keys do not increase"):
        contents(small(**{f"at{root + second}": again}))


def test_a_tree_deeper_than_it_says_and_more_entries_than_fit(small):
    at = PAGE + 16 + 24 + 48
    for place, new in ((6, b"\x20\0"), (6, b"\x21\0"), (6, b"\x01\0"), (32, struct.pack("<Q", 2**50))):
        with pytest.raises(InputError, match="is damaged"):
            contents(small(**{f"at{at + place}": new}))
    with pytest.raises(InputError, match="201 entries are announced and 200 exist"):
        contents(small(**{f"at{at + 32}": struct.pack("<Q", 201)}))
    with pytest.raises(InputError, match="the tree has more data"):
        contents(small(**{f"at{at + 32}": struct.pack("<Q", 199)}))


def test_entries_that_lie_over_each_other_are_refused(tmp_path):
    # All entries of a page of 64 KiB point at one long key: copied for each, it would come to 500 MB.
    path = write_lmdb(tmp_path, {b"%0500d" % n: b"x" for n in range(60)}, 65536)
    data = bytearray(path.read_bytes())
    at = 2 * 65536
    lower, upper = 16 + 2 * 8000, 32768
    struct.pack_into("<QHHHH", data, at, 2, 0, 2, lower, upper)
    data[at + 16 : at + lower] = struct.pack("<H", upper) * 8000
    data[at + upper : at + upper + 8] = _NODE.pack(0, 0, 0, 30_000)
    path.write_bytes(data)
    with pytest.raises(InputError, match="overlap"):
        contents(path)
    assert peak_memory(contents, path) < 2**20


def test_large_values(small, tmp_path):
    path = small()
    assert contents(path)[b"007"] == b"y" * 9000
    with pytest.raises(InputError, match="a value of 9000 bytes, and the limit is 8999"):
        contents(path, Limits(size=8999))
    data = path.read_bytes()
    run = data.index(b"y" * 100) - 16
    for new in (struct.pack("<Q", 99), struct.pack("<QHHI", run // PAGE, 0, 4, 1), struct.pack("<QHHI", 2, 0, 2, 9)):
        with pytest.raises(InputError, match="expected the start of a large value"):
            contents(small(**{f"at{run}": new}))
    node = data.index(b"007", PAGE * 2) - 8
    with pytest.raises(InputError, match="damaged"):
        contents(small(**{f"at{node}": b"\xff\xff\xff\x0f"}))
    assert peak_memory(contents, path) < 2**20


def test_cut_short(small):
    path = small()
    whole = path.read_bytes()
    for pages in range(1, len(whole) // PAGE):
        path.write_bytes(whole[: pages * PAGE + 100])
        with pytest.raises(InputError):
            contents(path)


def test_the_newer_start_page_counts(tmp_path):
    path = write_lmdb(tmp_path, SMALL)
    data = bytearray(path.read_bytes())
    first, second = data[16:PAGE], data[PAGE + 16 : 2 * PAGE]
    data[16:PAGE], data[PAGE + 16 : 2 * PAGE] = second, first
    path.write_bytes(data)
    assert contents(path) == SMALL
    data[PAGE + 16 : PAGE + 20] = b"\0\0\0\0"
    path.write_bytes(data)
    with pytest.raises(InputError, match="page 1 is damaged"):
        contents(path)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("lmdb")
    write_lmdb(path / "whole", SMALL)
    return path


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_damaged_databases(data, folder):
    whole = (folder / "whole" / "data.mdb").read_bytes()
    path = folder / "data.mdb"
    path.write_bytes(data.draw(damaged([whole, STORED[: 20 * PAGE]])) or b"\0")
    limits = Limits(size=2**16)
    try:
        with LmdbFile(path, limits) as database:
            for key, value in database.items():
                assert type(key) is type(value) is bytes
                assert len(value) <= 2**16
            database.get(b"100")
    except InputError as error:
        check_message(error, path)
    assert peak_memory(contents, path, limits) < 2**20
    assert calls_made(contents, path, limits) < 10_000 + path.stat().st_size


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_damaged_headers_and_nodes(data, folder):
    """Numbers that mean something, changed: headers of pages, places of nodes, and nodes."""
    whole = bytearray((folder / "whole" / "data.mdb").read_bytes())
    path = folder / "data.mdb"
    pages = len(whole) // PAGE
    for _ in range(data.draw(st.integers(1, 4))):
        page = data.draw(st.integers(0, pages - 1)) * PAGE
        count = max(1, (struct.unpack_from("<H", whole, page + 12)[0] - 16) // 2)
        node = struct.unpack_from("<H", whole, page + 16 + 2 * data.draw(st.integers(0, min(count, 1000) - 1)))[0]
        at = page + data.draw(st.one_of(st.integers(0, 40), st.integers(node, node + 8)))
        new = data.draw(st.one_of(st.sampled_from([0, 1, 2, 3, pages, 0xFFFF]), st.integers(0, 0xFFFF)))
        if at + 2 <= len(whole):
            struct.pack_into("<H", whole, at, new)
    path.write_bytes(whole)
    try:
        found = contents(path)
    except InputError as error:
        check_message(error, path)
    else:
        assert len(found) <= len(SMALL)
