# -*- coding: utf-8 -*-
# ruff: noqa: PTH123, RUF005, UP009, UP025, UP031 - Python 2.7 runs this file too
# fmt: off
"""A made-up value for the pickles in ``untrusted_payloads.tar.xz``, and the script that wrote them.

Run by Python 2.7 with NumPy 1.16.6 and by Python 3.6 with NumPy 1.15.4, with an output folder, for protocols 0 to 2.
"""

import collections
import pickle
import sys

import numpy as np


def value():
    return {
        "poses": np.arange(6, dtype=">f4").reshape(2, 3),
        "name": "abc",
        u"t\xe9": [1, 2.5, 2**70, None, True, (1,), b"\xff\x00"],
        "codes": np.asfortranarray(np.arange(4, dtype=np.int16).reshape(2, 2)),
        "words": np.array(["ab", "c"]),
        "mean": np.float64(0.5),
        "objects": np.array([1, "a", None], dtype=object),
        "order": collections.OrderedDict([("b", 1)]),
        "set": {3},
        "flags": np.array([True, False]),
    }


if __name__ == "__main__":
    for protocol in range(3):
        name = "%s/python%d.%d-protocol%d" % ((sys.argv[1],) + sys.version_info[:2] + (protocol,))
        with open(name, "wb") as file:
            pickle.dump(value(), file, protocol)
