"""A motion as a program of a robot, read back by the makers' grammar."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.planning.test_programme import STEP, bell, rest
from tests.synthetic import arm

from irtwin import modelling
from irtwin.errors import InputError
from irtwin.planning.robot_program import krl, urscript
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion

NUMBER = r"-?\d+(?:\.\d+)?"
JOINTS = rf"\[({NUMBER}(?:, {NUMBER}){{5}})\]"
MOVEJ = re.compile(rf"  movej\({JOINTS}, a=({NUMBER}), v=({NUMBER})(?:, t=({NUMBER}), r=({NUMBER}))?\)")
AXES = ", ".join(f"A{axis} ({NUMBER})" for axis in range(1, 7))
PTP = re.compile(rf"PTP \{{{AXES}\}}( C_PTP)?")
SHARE = re.compile(r"\$(VEL|ACC)_AXIS\[([1-6])\]=(\d+)")


def robot(joints: int = 6) -> Robot:
    known = arm(joints)
    return replace(known, joints=tuple(replace(one, velocity=3.0, acceleration=20.0) for one in known.joints))


def motion() -> Motion:
    """A straight way to joint positions of 0.5 of a bell, a pause of a second, and a way that bends."""
    parts = [rest(0.5), bell(1.0), rest(1.0), bell(1.0), rest(0.5)]
    dq = np.concatenate(parts)[:, None] * np.array([1.0, -0.5, 0.2, 0.0, 0.1, 0.3])
    bend = np.zeros_like(dq)
    half = round(0.5 / STEP)
    bend[5 * half : 6 * half, 3], bend[6 * half : 7 * half, 3] = 0.4, -0.4
    dq = dq + bend
    return Motion(np.arange(len(dq)) * STEP, np.cumsum(dq, axis=0) * STEP, dq, np.gradient(dq, STEP, axis=0), run="w")


def test_urscript_goes_through_the_motion_in_its_time() -> None:
    known = motion()
    head, comment, *lines, end = urscript(known, robot(), "weld 1").splitlines()
    assert (head, end) == ("def weld_1():", "end")
    assert comment.startswith("  # Joint positions are those of the URDF")
    moves = [match for line in lines if (match := MOVEJ.fullmatch(line))]
    waits = [float(match[1]) for line in lines if (match := re.fullmatch(rf"  sleep\(({NUMBER})\)", line))]
    assert len(moves) + len(waits) == len(lines)
    poses = np.array([[float(value) for value in move[1].split(", ")] for move in moves])
    assert poses[0] == pytest.approx(known.q[0], abs=1e-5) and poses[-1] == pytest.approx(known.q[-1], abs=1e-5)
    for pose in poses:
        assert np.abs(known.q - pose).max(axis=1).min() < 1e-5
    assert sum(waits) + sum(float(move[4]) for move in moves[1:]) == pytest.approx(known.time[-1], abs=0.03)
    assert waits[1] == pytest.approx(1.0, abs=0.05)
    blends = [float(move[5]) for move in moves[1:]]
    assert blends[0] == blends[-1] == 0.0 and 2 <= len(blends[1:-1]) <= 8 and min(blends[1:-1]) > 0


def test_krl_says_degrees_and_shares_of_the_axes_speed() -> None:
    known = motion()
    lines = krl(known, robot(), "weld-1").splitlines()
    assert lines[0] == "DEF weld_1()" and lines[1].startswith(";Joint positions") and lines[-1] == "END"
    rest_of = lines[4:-1]
    assert lines[2:4] == ["BAS(#INITMOV,0)", "$APO.CPTP=50"]
    assert all(PTP.fullmatch(x) or SHARE.fullmatch(x) or re.fullmatch(rf"WAIT SEC {NUMBER}", x) for x in rest_of)
    moves = [match for line in rest_of if (match := PTP.fullmatch(line))]
    assert np.radians([float(value) for value in moves[-1].groups()[:6]]) == pytest.approx(known.q[-1], abs=1e-5)
    through = [bool(move[7]) for move in moves]
    assert not any(through[:2]) and all(through[2:-1]) and not through[-1]
    shares = [match.groups() for line in rest_of if (match := SHARE.fullmatch(line))]
    fastest = {axis: percent for kind, axis, percent in shares[12:24] if kind == "VEL"}
    assert int(fastest["1"]) == np.ceil(100 * np.abs(known.dq[:, 0]).max() / 3.0)
    assert all(1 <= int(percent) <= 100 for _, _, percent in shares)


def test_a_program_is_written_by_the_ending(tmp_path: Path) -> None:
    modelling.write_motion(motion(), robot(), tmp_path / "1_weld.src")
    assert (tmp_path / "1_weld.src").read_text().startswith("DEF p_1_weld()\n")


def test_what_has_not_six_turning_joints_has_no_program() -> None:
    seven = Motion(np.arange(3.0), *np.zeros((3, 3, 7)), run="r")
    for program, language in ((urscript, "URScript"), (krl, "KRL")):
        told = rf"{language} is written for six turning joints; write the motion as .csv"
        with pytest.raises(InputError, match=told):
            program(seven, robot(7), "r")
