"""What can be said of a page in a browser: what axe-core finds wrong with it, and whether it is dark."""

from __future__ import annotations

from typing import Any

import pytest

OF_THE_SCREEN = ("color-contrast", "scrollable-region-focusable", "link-in-text-block")  # rules on widths and colours
# Of many alike the first few are read: a page of hundreds takes half a minute. Plots have their text as a picture.
_UNREAD = [[".main-svg"], *([f"{tag}:nth-of-type(n+9)"] for tag in ("article", "tr", "li", "dt", "dd"))]


def faults(page: Any, *parts: str, rules: tuple[str, ...] = ()) -> list[tuple[str, list[Any]]]:
    """Return what axe-core finds wrong by some rules or by all, on the whole page or in parts of it."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    context = {"exclude": _UNREAD} | ({"include": [[part] for part in parts]} if parts else {})
    only = {"runOnly": {"type": "rule", "values": list(rules)}} if rules else {}
    found = axe.Axe().run(page, context=context, options={"resultTypes": ["violations"]} | only).response
    return [(fault["id"], [node["target"] for node in fault["nodes"]]) for fault in found["violations"]]


def narrow_and_dark(page: Any) -> list[tuple[str, list[Any]]]:
    """Make a page that `faults` has read narrow and dark; return what is wrong with it now."""
    return on_screen(page, 400, "dark")


def on_screen(page: Any, width: int, scheme: str) -> list[tuple[str, list[Any]]]:
    """Show a page that `faults` has read on another screen; return what is wrong with it there."""
    page.set_viewport_size({"width": width, "height": 900})
    page.emulate_media(color_scheme=scheme)
    wrong: list[tuple[str, list[Any]]] = [] if is_dark(page) == (scheme == "dark") else [("not", [scheme])]
    for _ in range(20):  # plots follow the window a moment later
        if (wide := page.evaluate("document.documentElement.scrollWidth")) == width:
            break
        page.wait_for_timeout(100)
    else:
        wrong.append(("wide", [wide]))
    return wrong + faults(page, rules=OF_THE_SCREEN)


def complaints_of(page: Any, mine: tuple[str, ...] | None = None) -> list[str]:
    """Return a list that takes what a page complains of, but for what the driver of the graphics says of its speed.

    mine: how the addresses begin that it may ask; it complains of all others.
    """
    complaints: list[str] = []

    def hear(message: Any) -> None:
        if "GL Driver Message (OpenGL, Performance" not in message.text:
            complaints.append(f"{message.type}: {message.text}")

    page.on("console", hear)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("dialog", lambda dialog: complaints.append(dialog.message))
    if mine is not None:
        page.on("request", lambda it: None if it.url.startswith(mine) else complaints.append(it.url))
    return complaints


def is_dark(page: Any) -> bool:
    """Whether a page is light on dark."""
    back, ink = (
        [int(part) for part in page.evaluate(f"getComputedStyle(document.body).{of}").strip("rgb()").split(",")]
        for of in ("backgroundColor", "color")
    )
    return sum(back) < sum(ink)
