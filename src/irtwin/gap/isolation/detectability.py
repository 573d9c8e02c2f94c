"""What the data cannot show, and why."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from irtwin.document.document import Untestable
from irtwin.effects.effect import Effect
from irtwin.gap.isolation.structure_search import Attribution
from irtwin.gap.thresholds import Criterion
from irtwin.signals.motion import Motion


def can_show(effect: Effect, motions: Iterable[Motion]) -> bool:
    """Return whether what the effect depends on was measured in some motion."""
    seen = list(motions)
    return all(any(getattr(motion, signal) is not None for motion in seen) for signal in effect.requires)


def untestable(
    known: Iterable[Effect],
    inside: Sequence[str],
    channels: Sequence[tuple[str, Attribution]],
    motions: Iterable[Motion],
    limits: Criterion,
) -> tuple[Untestable, ...]:
    """Return the effects that the data cannot show: nothing measures them, or the twin imitates them."""
    motions = tuple(motions)
    visible: dict[str, tuple[float, float]] = {}
    least = {name: limits.visible(len(attribution.hypotheses)) for name, attribution in channels}
    for _, attribution in channels:
        for k, hypothesis in enumerate(attribution.hypotheses):
            name = hypothesis.effect
            visible[name] = max(visible.get(name, (0.0, 0.0)), tuple(attribution.visible[k].tolist()))
    whys = {}
    for effect in known:
        if effect.id in inside:
            continue
        channel, (shown, share) = effect.signal, visible.get(effect.id, (0.0, 0.0))
        if channel not in least:
            whys[effect.id] = f"no {channel} was measured"
        elif not can_show(effect, motions):
            whys[effect.id] = f"no {' and no '.join(sorted(effect.requires))} was measured"
        elif not effect.has_what_it_alters(inside):
            whys[effect.id] = f"the twin has no {effect.alters}, which it alters"
        elif shown == 0:
            whys[effect.id] = "nothing in these runs brings it about"
        elif shown < least[channel]:
            whys[effect.id] = f"the rest of the twin imitates {100 * (1 - share):.0f} % of it on these runs"
    return tuple(Untestable(effect=effect, why=why) for effect, why in whys.items())
