"""What can be said of a page in a browser: what axe-core finds wrong with it, and whether it is dark."""

from __future__ import annotations

from typing import Any

import pytest

OF_THE_SCREEN = ("color-contrast", "scrollable-region-focusable", "link-in-text-block")  # rules on widths and colours


def faults(page: Any, *parts: str) -> list[tuple[str, list[Any]]]:
    """Return what axe-core finds wrong, on the whole page or in parts of it."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    context = {"include": [[part] for part in parts]} if parts else None
    return _told(axe.Axe().run(page, context=context, options={"resultTypes": ["violations"]}).response)


def narrow_and_dark(page: Any) -> list[tuple[str, list[Any]]]:
    """Make a page that `faults` has read narrow and dark; return what is wrong with it now."""
    page.set_viewport_size({"width": 400, "height": 900})
    page.emulate_media(color_scheme="dark")
    wrong: list[tuple[str, list[Any]]] = [] if is_dark(page) else [("light", [])]
    for _ in range(20):  # plots follow the window a moment later
        if (width := page.evaluate("document.documentElement.scrollWidth")) == 400:
            break
        page.wait_for_timeout(100)
    else:
        wrong.append(("wide", [width]))
    rules = "only => axe.run({ runOnly: { type: 'rule', values: only }, resultTypes: ['violations'] })"
    return wrong + _told(page.evaluate(rules, list(OF_THE_SCREEN)))


def is_dark(page: Any) -> bool:
    """Whether a page is light on dark."""
    back, ink = (
        [int(part) for part in page.evaluate(f"getComputedStyle(document.body).{of}").strip("rgb()").split(",")]
        for of in ("backgroundColor", "color")
    )
    return sum(back) < sum(ink)


def _told(found: Any) -> list[tuple[str, list[Any]]]:
    return [(fault["id"], [node["target"] for node in fault["nodes"]]) for fault in found["violations"]]
