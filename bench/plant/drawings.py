"""The robots that can be built: the KR6, which ships, and those drawn for this bench."""

from __future__ import annotations

from pathlib import Path

from irtwin.demo.plant import machine

ROBOTS = Path(__file__).parent / "robots"
SHIPPED, URDFS = Path(machine.__file__).parent, Path(__file__).parents[2] / "ontology" / "robots"


def read_drawings(name: str) -> machine.Drawings:
    """Return the drawings of a robot by its name."""
    own = (ROBOTS / f"{name}.toml").exists()
    return machine.read_drawings(
        (ROBOTS if own else SHIPPED) / f"{name}.toml", (ROBOTS if own else URDFS) / f"{name}.urdf"
    )
