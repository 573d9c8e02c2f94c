"""A diagnosis by playing, handed over to MuJoCo's own system identification as a script that is ready to run."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from irtwin.document.document import Document
from irtwin.simulator.choice import DifferingNumbers
from irtwin.simulator.differences import not_held
from irtwin.simulator.payload import together
from irtwin.simulator.servos import CALLED, HOLDS, NAMES, OF_JOINTS, tilted

_SCRIPT = Path(__file__).with_name("sysid_script.py")
_LEAST = 0.1  # of the smaller side, of what may not: motion alone hardly tells the scale of a joint without gravity
_SIGNED = {  # what may be below zero, and how far beyond both sides it is sought at least: rad, m, m/s^2
    "offset": (0.0,),
    "mass": (np.nan, 0.5, 0.5, 0.5),  # a mass may not, its centre may
    "gravity": (1.0, 1.0),
}

Free = tuple[str, str, list[float], list[float], list[float], list[float]]  # as FREE of the script


def script(chosen: DifferingNumbers, document: Document, logs: Path, out: Path) -> bytes:
    """Return the script that fits what a diagnosis says differs to `logs`, a data set, to be written to `out`."""
    lacking = [f"{cause.effect} of {', '.join(cause.joints)}" for cause in not_held(document)]
    model = chosen.fit.servos.model
    return written(free(chosen), lacking, model.file.path, logs, out, model.gains, model.joints)


def written(
    some: Iterable[Free],
    lacking: Iterable[str],
    model: Path,
    logs: Path,
    out: Path,
    gains: Mapping[str, tuple[float, float]] | None = None,
    joints: Sequence[str] = (),
) -> bytes:
    """Return the script that frees some numbers of a model; it names files from where it is.

    gains: of the controllers of joints that have no servo in the model; joints: the robot's as the model calls them.
    """
    files = [os.path.relpath(file.absolute(), out.absolute().parent) for file in (model, logs)]
    told = {
        "MODEL, LOGS, FITTED": ", ".join(map(repr, [*files, f"{out.stem}-fitted.xml"])),
        "GAINS": repr(dict(gains or {})),
        "JOINTS": repr(tuple(joints)),
        "FREE": _lines(some),
        "LACKS": _lines(lacking),
    }
    text = _SCRIPT.read_text(encoding="utf-8")
    for name, value in told.items():
        default = re.search(rf"^{name}\b.*? = (.*)$", text, re.MULTILINE)
        assert default is not None
        text = text[: default.start(1)] + value + text[default.end(1) :]
    return text.encode()


def free(chosen: DifferingNumbers) -> Iterator[Free]:
    """Yield what differs: joint or body, number, the model's, the robot's, and bounds, as far beyond as they differ."""
    servos = chosen.fit.servos
    own, robots, model = servos.of_file(servos.numbers), servos.of_file(chosen.numbers), servos.model
    before_gear = np.array([np.ones(own.shape[1]), servos.gears**2])
    ways = [np.array(servos.dampings(some[NAMES.index("damping")])) / before_gear for some in (own, robots)]
    for row, name in enumerate(OF_JOINTS):
        for place in np.flatnonzero(chosen.differs[row]):
            joint = model.joints[place]
            if name == "damping":
                which = int(ways[0][1, place] != ways[1][1, place])  # of two, what differs
                yield _bounded(joint, ("damping", "kv")[which], *(some[which, place] for some in ways))
            elif name in CALLED:
                yield _bounded(joint, CALLED[name], own[row, place], robots[row, place])
    mass, *off = robots[len(OF_JOINTS) :, 0]
    if chosen.differs[NAMES.index("payload")].any():
        bare, laden = (together(model.compiled, model.flange, carried, np.array(off[:3])) for carried in (0.0, mass))
        body = model.compiled.body(model.flange.body).name
        yield _bounded(body, "mass", *(np.array([whole.mass, *whole.lever]) for whole in (bare, laden)))
    if chosen.differs[NAMES.index("tilt_x")].any():
        yield _bounded("world", "gravity", *(tilted(model.compiled, some)[:2] for some in ([0.0, 0.0], off[3:])))


def _bounded(of: str, number: str, model: np.ndarray, robot: np.ndarray) -> Free:
    model, robot = np.atleast_1d(model, robot)
    ends = np.sort([model, robot], axis=0)
    reach = np.array(_SIGNED.get(number, (np.nan,)))
    width = np.fmax(np.maximum(ends[1] - ends[0], np.abs(ends).max(axis=0) / 2), reach)
    least = ends[0] - width
    least = np.where(np.isnan(reach), np.maximum(least, _LEAST * ends[0]), least)
    most = np.minimum(ends[1] + width, HOLDS if number == "solimpfriction" else np.inf)
    return of, number, model.tolist(), robot.tolist(), least.tolist(), most.tolist()


def _lines(values: Iterable[object]) -> str:
    told = [f"    {value!r},\n" for value in values]
    return "".join(["(\n", *told, ")"]) if told else "()"
