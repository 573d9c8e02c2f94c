"""Play a scene in a browser to its end: however few frames it plays, that it did is seen."""

from __future__ import annotations

from typing import Any

_NOTE = """() => {
    const button = document.querySelector('.is-play')
    const note = () => { document.body.dataset.played = `${document.body.dataset.played ?? ''} ${button.ariaLabel}` }
    new MutationObserver(note).observe(button, {attributeFilter: ['aria-label']})
}"""


def play(page: Any) -> None:
    """Press play at twenty times the speed; wait until the button has said "Pause", then "Play" again."""
    page.select_option(".is-speed", "20")
    page.evaluate(_NOTE)
    page.click(".is-play")
    page.wait_for_selector("body[data-played=' Pause Play']")
