"""Demands that every link inside a folder of HTML files leads to a file, and to an anchor that is in it."""

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """The links and anchors of a page."""

    def __init__(self):
        super().__init__()
        self.links, self.anchors = [], set()

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.anchors.update(value for key in ("id", "name") if (value := attributes.get(key)))
        self.links += [value for key in ("href", "src") if tag in ("a", "img") and (value := attributes.get(key))]


def read(path):
    page = Page()
    page.feed(path.read_text(encoding="utf-8"))
    return page


def main(folder):
    pages = {path.resolve(): read(path) for path in Path(folder).rglob("*.html")}
    broken, count = [], 0
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            count += 1
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.exists():
                broken.append(f"{path.name}: {link}: no such file")
            elif parts.fragment and target in pages and unquote(parts.fragment) not in pages[target].anchors:
                broken.append(f"{path.name}: {link}: no such anchor")
    for line in sorted(set(broken)):
        print(line, file=sys.stderr)
    print(f"{count} links in {len(pages)} pages, {len(set(broken))} broken")
    return bool(broken) or not count


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
