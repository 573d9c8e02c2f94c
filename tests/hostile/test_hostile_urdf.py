"""Robots' descriptions that are broken, too large, or meant to do harm; other faults are in robot/test_urdf."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.hostile.xml_attacks import attacks

pytestmark = pytest.mark.slow

LINK = (
    '<link name="{}"><inertial><mass value="1"/>'
    '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
JOINT = (
    '<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>'
    '<limit lower="-1" upper="1" velocity="1" effort="1"/></joint>'
)
GOOD = f'<robot name="r">{LINK.format("a")}{LINK.format("b")}{JOINT}</robot>'


def chain(length: int) -> str:
    links = "".join(f'<link name="l{n}"/>' for n in range(length + 1))
    joints = "".join(
        f'<joint name="j{n}" type="fixed"><parent link="l{n}"/><child link="l{n + 1}"/></joint>' for n in range(length)
    )
    return f'<robot name="r">{links}{joints}</robot>'


DTD = "a DTD or an entity"
DOCUMENT_TYPES = {
    **attacks('<robot name="{}"/>'),
    "outside DTD": '<!DOCTYPE robot SYSTEM "http://127.0.0.1:1/robot.dtd"><robot name="r"/>',
    "public DTD": '<!DOCTYPE robot PUBLIC "-//X//Y" "file:///etc/passwd"><robot name="r"/>',
    "empty document type": f"<!DOCTYPE robot []>{GOOD}",
    "default attributes": f'<!DOCTYPE robot [<!ATTLIST robot name CDATA "x">]>{GOOD}',
}
MALFORMED = {
    "nothing": ("", "not well-formed XML"),
    "blank": (" \n ", "not well-formed XML"),
    "no XML": ("robot: r", "not well-formed XML"),
    "null bytes": ("\x00" * 1000, "not well-formed XML|not readable as XML"),
    "undefined entity": ('<robot name="&nbsp;"/>', "not well-formed XML"),
    "cut off": (GOOD[: len(GOOD) // 2], "not well-formed XML"),
    "two roots": (GOOD * 2, "not well-formed XML"),
    "attribute twice": ('<robot name="r" name="s"/>', "not well-formed XML"),
    "unknown prefix": ("<x:robot/>", "not well-formed XML"),
    "strange encoding": (f'<?xml version="1.0" encoding="utf-7"?>{GOOD}', "XML"),
    "deep nesting": ("<robot>" + "<a>" * 100_000 + "</a>" * 100_000 + "</robot>", "has no link"),
    "deeper nesting": ("<robot>" + "<a>" * 500_000 + "</a>" * 500_000 + "</robot>", "has no link"),
    "a million attributes": ("<robot " + " ".join(f'a{n}=""' for n in range(300_000)) + "/>", "has no link"),
    "link without a name": ("<robot><link/></robot>", 'a link has no "name"'),
    "joint without a name": (GOOD.replace('name="j"', ""), 'a joint has no "name"'),
    "unknown child": (GOOD.replace('child link="b"', 'child link="x"'), "child link .* is not defined"),
    "loop": (GOOD.replace('child link="b"', 'child link="a"'), "loop|several bases"),
    "unknown type": (GOOD.replace("revolute", "teleport"), "cannot be modelled"),
    "short axis": (GOOD.replace("0 0 1", "0 1"), "3 finite numbers"),
    "not a number": (GOOD.replace('lower="-1"', 'lower="nan"'), "finite number"),
    "infinite": (GOOD.replace('velocity="1"', 'velocity="inf"'), "finite number"),
    "beyond a double": (GOOD.replace('effort="1"', 'effort="1e999"'), "finite number"),
    "code for a number": (GOOD.replace('mass value="1"', 'mass value="__import__(1)"'), "finite number"),
    "no mass": (GOOD.replace('mass value="1"', "mass"), "finite number"),
    "mass beyond a double": (GOOD.replace('mass value="1"', 'mass value="1e999"'), "finite number"),
    "negative inertia": (GOOD.replace('ixx="1"', 'ixx="-5"'), "inertia"),
    "inertia that is no number": (GOOD.replace('ixx="1"', 'ixx="x"'), "inertia"),
    "a number of a million digits": (GOOD.replace('lower="-1"', f'lower="{"9" * 1_000_000}"'), "finite number"),
    "a chain without a joint that moves": (chain(3000), "no joint moves"),
    "more links than a robot has": (chain(50_000), "50001 links; a robot of more than 5000"),
    "a chain deeper than any": (chain(501).replace("fixed", "continuous", 1), "a chain of more than 500 links"),
    "more axes than a robot has": (
        chain(101).replace("fixed", "continuous"),
        "101 joints move; a robot of more than 100",
    ),
}


def write(folder: Path, text: str) -> tuple[str, str, str]:
    (folder / "robot.urdf").write_text(text, encoding="utf-8")
    return "urdf", str(folder), "robot.urdf"


@pytest.mark.parametrize("name", DOCUMENT_TYPES)
def test_document_types(refused: Callable[..., str], tmp_path: Path, name: str) -> None:
    assert DTD in refused(*write(tmp_path, DOCUMENT_TYPES[name]))


@pytest.mark.parametrize("name", MALFORMED)
def test_malformed(refused: Callable[..., str], tmp_path: Path, name: str) -> None:
    text, message = MALFORMED[name]
    said = refused(*write(tmp_path, text))
    assert said.startswith(str(tmp_path / "robot.urdf"))
    assert re.search(message, said), said


def test_what_is_no_file(refused: Callable[..., str], tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "large").touch()
    os.truncate(tmp_path / "large", 10_000_000_000)
    (tmp_path / "bytes").write_bytes(os.urandom(1000))
    (tmp_path / "latin").write_bytes('<robot name="é"/>'.encode("latin-1"))
    (tmp_path / "wide").write_bytes(GOOD.encode("utf-16"))
    (tmp_path / "round").symlink_to(tmp_path / "round")
    for said, names in {
        "is not a file": ("pipe", "/dev/zero", "."),
        "is larger than": ("large",),
        "not UTF-8 text": ("bytes", "latin", "wide"),
        "cannot be read": ("round", "none"),
        "is not a file name": ("no\0ne",),
    }.items():
        for name in names:
            assert said in refused("urdf", str(tmp_path), name)
