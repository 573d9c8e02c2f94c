"""Robots as a URDF may describe them: a plan of plain values, its text, and the strategy that draws plans."""

from __future__ import annotations

from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

from hypothesis import strategies as st

NAMES = ("", "joint 1", "Ж", "名前", "100%", "a/b", "q_x", "a.b", "-", "'\"", "n" * 250, "é" * 40)
NUMBERS = (0.0, 1e-12, 1e-3, 1.0, 12.5, 1e6, 1e12)


@dataclass(frozen=True)
class Axis:
    """A joint and the link behind it. `parent` counts links before this one; mass None: the link has no inertia."""

    kind: str  # as in a URDF; "mimic" is a revolute joint that mimics the first
    parent: int = 0
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    offset: tuple[float, float, float] = (0.1, 0.0, 0.2)
    mass: float | None = 2.0
    inertia: float = 0.02
    limits: tuple[float, float, float, float] | None = (-2.5, 2.5, 3.0, 200.0)  # lower, upper, velocity, effort
    name: str = ""
    shape: str = ""


@dataclass(frozen=True)
class RobotPlan:
    """A robot's name and its axes, base to flange."""

    axes: tuple[Axis, ...]
    name: str = "arm"


def joint_names(plan: RobotPlan) -> list[str]:
    """Return the name of each axis, moving or not."""
    return [f"{axis.name}{number}" for number, axis in enumerate(plan.axes, start=1)]


def urdf(plan: RobotPlan) -> str:
    """Return the plan as URDF text."""
    names = joint_names(plan)
    links = ["base", *(f"link_{number}" for number in range(1, len(names) + 1))]
    parts = ['<link name="base"/>']
    for place, (axis, name) in enumerate(zip(plan.axes, names, strict=True)):
        parent = links[max(0, place - axis.parent)]
        parts.append(f'<link name="{links[place + 1]}">{_inertial(axis)}{_visual(axis)}</link>')
        kind = "revolute" if axis.kind == "mimic" else axis.kind
        inside = f'<parent link="{parent}"/><child link="{links[place + 1]}"/><origin xyz="{_triple(axis.offset)}"/>'
        if kind != "fixed":
            inside += f'<axis xyz="{_triple(axis.axis)}"/>'
        if axis.limits is not None and kind != "fixed":
            keys = ("lower", "upper", "velocity", "effort")
            inside += "<limit " + " ".join(f'{key}="{it}"' for key, it in zip(keys, axis.limits, strict=True)) + "/>"
        if axis.kind == "mimic":
            inside += f'<mimic joint={quoteattr(names[0])} multiplier="2"/>'
        parts.append(f'<joint name={quoteattr(name)} type="{kind}">{inside}</joint>')
    return f"<robot name={quoteattr(plan.name)}>{''.join(parts)}</robot>"


def _inertial(axis: Axis) -> str:
    if axis.mass is None:
        return ""
    moments = " ".join(f'i{k}{k}="{axis.inertia}"' for k in "xyz") + ' ixy="0" ixz="0" iyz="0"'
    return f'<inertial><origin xyz="0.05 0.01 0.1"/><mass value="{axis.mass}"/><inertia {moments}/></inertial>'


def _visual(axis: Axis) -> str:
    return f"<visual><geometry>{axis.shape}</geometry></visual>" if axis.shape else ""


def _triple(values: tuple[float, float, float]) -> str:
    return " ".join(map(str, values))


_KINDS = ("revolute",) * 8 + ("prismatic",) * 2 + ("continuous", "fixed", "mimic")
_AXES = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.6, 0.0, 0.8), (0.0, 0.0, -1.0))
_LIMITS = ((-2.5, 2.5, 3.0, 200.0), (-2.5, 2.5, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0), (-1e9, 1e9, 1e9, 1e9), None)
_SHAPES = ("", "", '<box size="0.1 0.1 0.2"/>', '<sphere radius="0"/>', '<mesh filename="package://x/y.stl"/>')
_FEW, _MANY = (1, 1, 2, 2, 3), (4, 6, 6, 7, 12, 40)


@st.composite
def _axis(draw: st.DrawFn, plain: bool) -> Axis:
    if plain:
        return Axis("revolute", axis=draw(st.sampled_from(_AXES)), mass=draw(st.sampled_from((8.0, 2.0, 0.5))))
    return Axis(
        kind=draw(st.sampled_from(_KINDS)),
        parent=draw(st.sampled_from((0, 0, 0, 0, 1, 2))),
        axis=draw(st.sampled_from(_AXES)),
        offset=draw(st.sampled_from(((0.1, 0.0, 0.2), (0.0, 0.0, 0.0), (1e3, 0.0, 0.0)))),
        mass=draw(st.sampled_from((*NUMBERS, None, 2.0, 2.0))),
        inertia=draw(st.sampled_from((*NUMBERS, 0.02, 0.02))),
        limits=draw(st.sampled_from(_LIMITS)),
        name=draw(st.sampled_from(("",) * 12 + NAMES)),
        shape=draw(st.sampled_from(_SHAPES)),
    )


@st.composite
def robots(draw: st.DrawFn, large: bool) -> RobotPlan:
    """Draw a robot of 1 to 3 axes, or of 4 to 40; half are arms of revolute joints as they are built."""
    plain = draw(st.booleans())
    count = draw(st.sampled_from(_MANY if large else _FEW))
    axes = tuple(draw(_axis(plain)) for _ in range(count))
    return RobotPlan(axes, name="arm" if plain else draw(st.sampled_from(("arm", *NAMES))) or "arm")
