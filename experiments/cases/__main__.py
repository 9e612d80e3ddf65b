"""Judge every problem file, a line each.

    python -m experiments.cases [FOLDER]

FOLDER holds ``bvh``, ``wav`` and ``textgrid``; by default ``cases`` beside the real recordings (A2G_SHARED_DATA). The
exit status is 1 if an outcome is wrong.
"""

import argparse
import sys
from pathlib import Path

from experiments.cases import bvh, textgrid, wav
from experiments.cases.runner import cases_folder, judge, line_of

CASES = (*bvh.CASES, *wav.CASES, *textgrid.CASES)


def main() -> int:
    """Print a line for each case and the number of right ones."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path, default=cases_folder())
    folder = parser.parse_args().folder
    right = 0
    for case in CASES:
        outcome = judge(case, folder)
        right += outcome[0]
        print(line_of(case, outcome), flush=True)
    print(f"{right} of {len(CASES)} right")
    return 0 if right == len(CASES) else 1


if __name__ == "__main__":
    sys.exit(main())
