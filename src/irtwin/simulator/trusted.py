"""What a user knows to be right of a simulator: effects, alone or by family, that no difference is looked for in."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from irtwin.effects.catalogue import catalogue
from irtwin.errors import InputError
from irtwin.simulator.writing import PUSH
from irtwin.simulator.writing import effects as of_servos


@dataclass(frozen=True)
class Trusted:
    """What is trusted: `effects` of the catalogue, by id; `numbers` of servos that stand for such, by name."""

    effects: tuple[str, ...] = ()
    numbers: frozenset[str] = frozenset()

    @property
    def pushes(self) -> bool:
        """Whether nothing is said to push."""
        return PUSH in self.numbers


NOTHING = Trusted()


def trusted(words: Iterable[str]) -> Trusted:
    """Return what families, or ids of effects, stand for. Raises InputError where one is neither."""
    families = {effect.id: effect.family for effect in catalogue().values()}
    numbers: Mapping[str, tuple[str, str]] = {name: told[:2] for name, told in of_servos().items()}
    effects: dict[str, None] = {}
    trusts: set[str] = set()
    for word in words:
        own = [effect for effect, family in families.items() if word in (effect, family)]
        those = [name for name, told in numbers.items() if word in told]
        if not own and not those:
            known = sorted({*families.values(), *(family for _, family in numbers.values())})
            raise InputError(f"trust {word}: is neither a family of effects ({', '.join(known)}) nor an effect's id")
        effects |= dict.fromkeys(own)
        trusts.update(those)
    return Trusted(tuple(effects), frozenset(trusts))
