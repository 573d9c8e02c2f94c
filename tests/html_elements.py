"""What a page of HTML is made of, as a browser reads it."""

from __future__ import annotations

import html
from html.parser import HTMLParser


class Elements(HTMLParser):
    """The elements of a page in their order, `found`, each with its attributes."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))

    def values(self, attribute: str) -> list[str]:
        """Return what elements have for an attribute."""
        return [said[attribute] or "" for _, said in self.found if attribute in said]


def plain(page: str) -> str:
    """Return text as it is read: characters for entities, and common spaces for those that do not break."""
    return html.unescape(page).replace("\N{NO-BREAK SPACE}", " ").replace("\N{NARROW NO-BREAK SPACE}", " ")
