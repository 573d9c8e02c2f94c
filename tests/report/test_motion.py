"""The page of a motion: what it asks of each joint, and whose torque and power it draws."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests import synthetic
from tests.html_elements import plain

from irtwin.errors import InputError
from irtwin.planning.plan import nominal_twin
from irtwin.report.motion import write_page
from irtwin.signals.motion import Motion


def swing() -> Motion:
    """Joint 1 turns by half a turn and back in 2 s, as fast as pi rad/s."""
    time = np.linspace(0.0, 2.0, 201)
    q = np.column_stack([1 - np.cos(np.pi * time), np.zeros_like(time)])
    dq = np.column_stack([np.pi * np.sin(np.pi * time), np.zeros_like(time)])
    ddq = np.column_stack([np.pi**2 * np.cos(np.pi * time), np.zeros_like(time)])
    return Motion(time, q, dq, ddq, run="swing")


def test_each_joint_is_held_against_its_limits(tmp_path: Path) -> None:
    arm = synthetic.arm(2)
    first = replace(arm.joints[0], lower=-np.pi, upper=np.pi, velocity=2 * np.pi)
    twin = nominal_twin(replace(arm, joints=(first, arm.joints[1])))
    write_page(twin, swing(), "swing", [("Condition number", "4.2")], tmp_path / "swing.html")
    html = (tmp_path / "swing.html").read_text()
    row = re.search(r'<tr><th scope="row">joint_1</th>.*?</tr>', html, re.S)
    assert row is not None
    said = plain(row[0])
    assert "0° … 114.6°" in said and "−180° … 180°" in said and "180°/s" in said and "50 %" in said
    assert "without friction" in html and "Power is mechanical" in html and "4.2" in html


def test_power_of_a_twin_that_saw_none_is_what_its_joints_take(tmp_path: Path) -> None:
    twin, motion = nominal_twin(synthetic.arm(2)), swing()
    write_page(twin, motion, "swing", [], tmp_path / "swing.html")
    data = re.search(r'id="page-data">(.*?)</script>', (tmp_path / "swing.html").read_text(), re.S)
    assert data is not None
    drawn = json.loads(data[1])["figures"]["power"]["data"][0]
    expected = np.sum(twin.joint_torque(motion) * motion.dq, axis=1)
    np.testing.assert_allclose(drawn["y"], expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max())


def test_a_place_where_nothing_can_be_written_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        write_page(nominal_twin(synthetic.arm(2)), swing(), "swing", [], tmp_path / "file" / "swing.html")
