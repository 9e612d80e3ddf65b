"""The made-up database in ``untrusted_payloads.tar.xz``, and the script that wrote it (lmdb 3.0.0, LMDB 0.9.36)."""


def entries(ted):
    """Keys and values in order; ``ted`` is a payload longer than a page, which therefore lies on pages of its own."""
    return {b"%010d" % n: ted if n < 6 else b"old%d" % n * (n % 40) for n in range(0, 400, 2)}


if __name__ == "__main__":
    import sys
    from pathlib import Path

    import lmdb

    target, payload = sys.argv[1:]
    environment = lmdb.open(target, map_size=2**22)
    with environment.begin(write=True) as transaction:
        for n in range(400):
            transaction.put(b"%010d" % n, b"old%d" % n * (n % 40))
    with environment.begin(write=True) as transaction:  # holes and old pages, as in a database that has lived
        for n in range(1, 400, 2):
            transaction.delete(b"%010d" % n)
        for key, value in entries(Path(payload).read_bytes()).items():
            transaction.put(key, value)
    environment.close()
