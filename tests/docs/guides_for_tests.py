"""The commands and programs in the README, the guides and CONTRIBUTING."""

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
_GLOBS = ("README.md", "CONTRIBUTING.md", "docs/*.md", "a2g_jax/*/*.md")
PAGES = sorted(path.relative_to(ROOT).as_posix() for glob in _GLOBS for path in ROOT.glob(glob))
_FENCE = re.compile(r"^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
_INLINE = re.compile(r"`(a2g [^`]+)`")
_FLAG = re.compile(r"(?<![\w-])--[a-z][a-z0-9-]*(?!\w)")


@dataclass(frozen=True)
class Command:
    """A line of a shell block."""

    page: str
    line: int
    text: str

    @property
    def words(self) -> list[str]:
        return shlex.split(self.text, comments=True)

    def __str__(self) -> str:
        return f"{self.page}:{self.line}"


@dataclass(frozen=True)
class Program:
    """A Python block."""

    page: str
    line: int
    text: str

    def __str__(self) -> str:
        return f"{self.page}:{self.line}"


def blocks(page: str, *languages: str) -> list[tuple[int, str]]:
    """First lines and texts of the blocks of a page."""
    text = (ROOT / page).read_text(encoding="utf-8")
    found = [(text[: one.start(2)].count("\n") + 1, one[1], one[2]) for one in _FENCE.finditer(text)]
    return [(line, block) for line, language, block in found if language in languages]


def commands(page: str) -> list[Command]:
    """All lines of shell blocks, parts joined by ``&&`` one by one."""
    found = []
    for first, block in blocks(page, "sh", "bash", "console"):
        for number, line in enumerate(block.splitlines()):
            text = re.split(r" [#>]", line)[0].strip()  # neither comments nor where output goes
            found += [Command(page, first + number, part.strip()) for part in text.split("&&") if part.strip()]
    return [one for one in found if not one.text.startswith("#")]


def programs(page: str) -> list[Program]:
    """All Python blocks."""
    return [Program(page, line, block) for line, block in blocks(page, "python", "py")]


def inline_commands(page: str) -> list[Command]:
    """Commands between backticks in the text."""
    text = re.sub(_FENCE, lambda match: "\n" * match[0].count("\n"), (ROOT / page).read_text(encoding="utf-8"))
    found = ((text[: one.start()].count("\n") + 1, one[1]) for one in _INLINE.finditer(text))
    return [Command(page, line, " ".join(command.split())) for line, command in found]


def flags(page: str) -> set[str]:
    """All words on a page that look like flags."""
    return set(_FLAG.findall((ROOT / page).read_text(encoding="utf-8")))
