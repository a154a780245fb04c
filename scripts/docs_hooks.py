"""What mkdocs does not do by itself: pages from elsewhere in the repository, links out of docs/."""

import posixpath
import re
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[1]
#: Pages of the site that are kept where people look for them in the repository.
ELSEWHERE = {'deploy.md': 'deploy/README.md'}
_LINK = re.compile(r'(!?)\[([^\]]*)\]\(([^)#\s]+)([^)]*)\)')


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages of `ELSEWHERE`."""
    for page, source in ELSEWHERE.items():
        text = (ROOT / source).read_text(encoding='utf-8')
        files.append(File.generated(config, page, content=text))
    return files


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:
    """Point links at the pages of `ELSEWHERE`; name other files of the repository, unlinked."""
    here = ELSEWHERE.get(page.file.src_uri, f'docs/{page.file.src_uri}')
    folder = posixpath.dirname(here)

    def linked(match: re.Match[str]) -> str:
        mark, text, target, rest = match.groups()
        if '://' in target or target.startswith('mailto:'):
            return match[0]
        path = posixpath.normpath(posixpath.join(folder, target))
        for name, source in ELSEWHERE.items():
            if path == source:
                up = posixpath.relpath(name, posixpath.dirname(page.file.src_uri) or '.')
                return f'{mark}[{text}]({up}{rest})'
        if path.startswith('docs/'):
            inside = path.removeprefix('docs/')
            if inside.endswith(('.json', '.csv', '.zip', '.parquet')):
                return f'{text} (`{path}`)'
            up = posixpath.relpath(inside, posixpath.dirname(page.file.src_uri) or '.')
            return f'{mark}[{text}]({up}{rest})'
        if not (ROOT / path).exists():
            raise ValueError(f'{here}: a link to {path}, which does not exist')
        return f'{text} (`{path}`)' if text.strip('`') != path else f'`{path}`'

    return _LINK.sub(linked, markdown)
