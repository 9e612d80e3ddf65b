"""All experiments on the generated corpus in order, and the page that shows their results.

    python -m experiments.talker [--only timing hidden ...] [--seed 0] [--shared ../shared] [--page]

`--page` only renders README.md from the existing JSON files.
"""

import argparse
import json
import os
import sys
import time
from pathlib import Path

from experiments.talker import bounds, cost, emotions, hidden, predictable, realism, timing, voices
from experiments.talker.common import PICTURES, RESULTS, ROOT, Part, run_part

PARTS = (timing.PART, hidden.PART, predictable.PART, emotions.PART, voices.PART, realism.PART, bounds.PART, cost.PART)
PAGE = Path(__file__).parent / "README.md"
_HEAD = """# The generated corpus, measured

Everything below is measured by the modules of this folder and rendered by `python -m experiments.talker --page` from
the JSON files in `results/`; no number is typed. Run all of it, from the repository root, by

    pip install -e ".[experiments,voices]"
    python -m experiments.talker

or one part by the command above its tables. The comparison with real takes needs a few small real recordings, which are
not in this repository (`--shared FOLDER`); without them it shows only the generated side.

Intervals are 95 %; a null is the value of the same measure when the relation it tests is destroyed.
"""


def page(folder: Path, pictures: Path) -> str:
    """Text of README.md from the existing results."""
    sections = [_HEAD]
    for part in PARTS:
        path = folder / f"{part.name}.json"
        if not path.exists():
            continue
        document = json.loads(path.read_text())
        sections.append(f"## {part.title}\n\n    {document['command']}\n")
        sections.append(
            f"{document['date'][:10]}, version {document['a2g_jax']}, {document['cores']} cores, "
            f"{document['seconds']:.0f} s.\n"
        )
        picture = pictures / f"talker_{part.name}.png"
        if part.picture is not None and picture.exists():
            sections.append(f"![{part.title}]({Path(os.path.relpath(picture, folder.parent)).as_posix()})\n")
        sections.append(part.tables(document["result"]))
    return "\n".join(sections)


def arguments_of(part: Part, options: argparse.Namespace) -> list[str]:
    """Arguments passed on to one part."""
    arguments = ["--seed", str(options.seed), "--workers", str(options.workers)]
    return [*arguments, "--shared", str(options.shared)] if part is realism.PART else arguments


def main() -> None:
    """Run the requested parts, then render the page."""
    names = [part.name for part in PARTS]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=names, default=names)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--shared", type=Path, default=ROOT.parent / "shared", help="folder with data/ of real takes")
    parser.add_argument("--page", action="store_true", help="only render the page")
    options = parser.parse_args()
    if not options.page:
        for number, name in enumerate(options.only, start=1):
            start = time.perf_counter()
            print(f"[{number} of {len(options.only)}] {name} ...", file=sys.stderr, flush=True)
            part = PARTS[names.index(name)]
            run_part(part, arguments_of(part, options))
            print(f"    {time.perf_counter() - start:.0f} s", file=sys.stderr, flush=True)
    PAGE.write_text(page(RESULTS, PICTURES))


if __name__ == "__main__":
    main()
