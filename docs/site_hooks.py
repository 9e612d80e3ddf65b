"""Hooks of MkDocs: pages outside ``docs/``, links between them, and the page of public names.

A page lies on the site at its path in the repository, pages of ``docs/`` without that prefix. Links in Markdown are
those of the repository, so that they also work in the unrendered files; here they are turned into links of the site,
and every file that a page links to is copied there.
"""

import ast
import posixpath
import re
from pathlib import Path
from urllib.parse import unquote

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parent.parent
#: Pages outside of ``docs/`` that the navigation names; others follow by their links.
PAGES = (
    "README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "experiments/README.md",
    "experiments/benchmarks/README.md",
    "experiments/talker/README.md",
    *(f"a2g_jax/{name}/MODEL_CARD.md" for name in ("demo", "demo_flow", "demo_features")),
)
_LINK = re.compile(r"(\]\()([^)\s#]+)(#[^)\s]*)?(\))")
_ROLE = re.compile(r":(?:mod|class|func|meth|data|attr):<code>(~?)([\w.]+)</code>")
_CODE = re.compile(r"^(```|~~~).*?^\1", re.MULTILINE | re.DOTALL)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages outside ``docs/``, all that they link to, and the page of public names."""
    files.append(File.generated(config, "api.md", content=public_names()))
    waiting = [*PAGES, *(f"docs/{file.src_uri}" for file in files.documentation_pages() if file.abs_src_path)]
    added = set(waiting)
    while waiting:
        path = waiting.pop()
        if not path.startswith("docs/"):
            files.append(File.generated(config, path, abs_src_path=str(ROOT / path)))
        if not path.endswith(".md"):
            continue
        text = _CODE.sub("", (ROOT / path).read_text(encoding="utf-8"))
        for _, target, _, _ in _LINK.findall(text):
            linked = _repository_path(path, target)
            if linked and linked not in added and not linked.startswith("docs/") and (ROOT / linked).is_file():
                added.add(linked)
                waiting.append(linked)
    return files


def on_page_markdown(markdown: str, page: Page, **_: object) -> str:
    """Turn links of the repository into links of the site."""
    here = page.file.src_uri
    source = here if (ROOT / here).is_file() else f"docs/{here}"

    def link(match: re.Match[str]) -> str:
        opening, target, anchor, closing = match.groups(default="")
        linked = _repository_path(source, target)
        if linked is None:
            return match[0]
        if (ROOT / linked).is_dir():
            return f"{opening}{_relative('README.md', here)}{closing}"
        return f"{opening}{_relative(linked.removeprefix('docs/'), here)}{anchor}{closing}"

    return _LINK.sub(link, markdown)


def on_page_content(html: str, **_: object) -> str:
    """Show cross-references of docstrings, which are Sphinx roles, as code."""

    def name(match: re.Match[str]) -> str:
        return f"<code>{match[2].rpartition('.')[2] if match[1] else match[2]}</code>"

    return _ROLE.sub(name, html)


def public_names() -> str:
    """Markdown of the public names of :mod:`a2g_jax`, read from its source, which imports them on first use."""
    tree = ast.parse((ROOT / "a2g_jax" / "__init__.py").read_text(encoding="utf-8"))
    exports: dict[str, str] = next(
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "_EXPORTS"
    )
    parts = ["# Public names\n\n`import a2g_jax` gives these; each is imported on first use.\n"]
    parts += [f"::: {module}.{name}\n" for name, module in sorted(exports.items(), key=lambda item: item[0].lower())]
    return "\n".join(parts)


def _relative(target: str, page: str) -> str:
    return posixpath.relpath(target, posixpath.dirname(page) or ".")


def _repository_path(page: str, target: str) -> str | None:
    """Where a link of a page leads to in the repository; None where it leads out of it or nowhere."""
    if "://" in target or target.startswith(("mailto:", "/")):
        return None
    path = posixpath.normpath(posixpath.join(posixpath.dirname(page), unquote(target)))
    return path if not path.startswith("..") and (ROOT / path).exists() else None
