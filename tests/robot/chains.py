"""Random chains of joints as URDF text: axes parallel, crossing, skew, joints that slide, a tilted base, a tool."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

_ANGLES = st.one_of(st.sampled_from([0.0, np.pi / 2, -np.pi / 2, np.pi]), st.integers(-300, 300).map(lambda k: k / 100))
_LENGTHS = st.one_of(st.just(0.0), st.integers(-100, 100).map(lambda k: k / 100))
_AXES = st.sampled_from(["0 0 1", "0 0 -1", "1 0 0", "0 1 0", "0 -1 0", "0.6 0 0.8", "1 2 2"])


@st.composite
def chains(draw: st.DrawFn) -> str:
    """Draw the URDF text of an open chain of one to seven joints."""
    parts = ['<robot name="chain"><link name="base"/>']
    parent = "base"
    for number in range(1, draw(st.integers(1, 7)) + 1):
        kind = draw(st.sampled_from(["revolute", "revolute", "continuous", "prismatic"]))
        xyz, rpy = _three(draw, _LENGTHS), _three(draw, _ANGLES)
        parts.append(
            f'<link name="body_{number}"><inertial><origin xyz="0.1 0 -0.3" rpy="0.3 0 0.2"/><mass value="{number}"/>'
            '<inertia ixx="0.3" iyy="0.2" izz="0.25" ixy="0.01" ixz="-0.02" iyz="0.03"/></inertial></link>'
            f'<joint name="axis_{number}" type="{kind}"><origin xyz="{xyz}" rpy="{rpy}"/><parent link="{parent}"/>'
            f'<child link="body_{number}"/><axis xyz="{draw(_AXES)}"/>'
            '<limit lower="-2" upper="1.5" velocity="3" effort="40"/></joint>'
        )
        parent = f"body_{number}"
    parts.append(
        f'<link name="tool"/><joint name="tool_joint" type="fixed"><parent link="{parent}"/><child link="tool"/>'
        f'<origin xyz="{_three(draw, _LENGTHS)}" rpy="{_three(draw, _ANGLES)}"/></joint></robot>'
    )
    return "".join(parts)


def _three(draw: st.DrawFn, values: st.SearchStrategy[float]) -> str:
    return " ".join(repr(draw(values)) for _ in range(3))
