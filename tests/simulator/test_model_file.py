from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from irtwin.errors import InputError
from irtwin.simulator.formats import read_model_file

TEXT = """<?xml version='1.0'?>
<!-- an arm; <joint name="lift" damping="7"/> was here -->
<mujoco model="arm">
  <default><joint damping="0.6"/></default>
  <worldbody>
    <body name="a"><joint name="pan"  axis='0 0 1' damping = '1.0'
      user="3 > 2"/><geom size=".1"/>
      <body name="b"><joint name="lift" class="x" ></joint></body>
    </body>
  </worldbody>
</mujoco>
"""


def model(folder, text=TEXT):
    file = folder / "arm.xml"
    file.write_text(text, encoding="utf-8")
    return file


def test_a_file_with_nothing_changed_is_the_same_bytes(tmp_path):
    file = model(tmp_path)
    assert read_model_file(file).changed({}) == file.read_bytes()


def test_changed_numbers_alone_differ(tmp_path):
    file = read_model_file(model(tmp_path))
    pan, lift = (file.element(["joint"], "name", name) for name in ("pan", "lift"))
    new = {pan: {"damping": 1.25}, lift: {"armature": 0.5}}
    expected = TEXT.replace("damping = '1.0'", "damping = '1.25'").replace('class="x" >', 'class="x" armature="0.5">')
    assert file.changed(new).decode() == expected


def test_an_element_takes_another_name_and_attributes_go(tmp_path):
    file = read_model_file(model(tmp_path))
    changed = file.changed({file.element(["joint"], "name", "lift"): {"": "freejoint", "class": None, "user": "1 2"}})
    assert changed.decode() == TEXT.replace(
        '<joint name="lift" class="x" ></joint>', '<freejoint name="lift" user="1 2"></freejoint>'
    )


@given(value=st.floats(0, 1e6))
def test_numbers_are_read_back_as_they_were(tmp_path_factory, value):
    folder = tmp_path_factory.mktemp("model")
    file = read_model_file(model(folder))
    changed = file.changed({file.element(["joint"], "name", "lift"): {"frictionloss": value}})
    elements = read_model_file(model(folder, changed.decode())).elements
    (lift,) = [one for one in elements if one.attributes.get("name") == "lift"]
    assert float(lift.attributes["frictionloss"]) == value


def test_an_element_of_another_file_is_not_changed(tmp_path):
    with pytest.raises(InputError, match=r'arm\.xml: has no <joint name="elbow"> of its own; give the file'):
        read_model_file(model(tmp_path)).element(["joint"], "name", "elbow")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<mujoco>", r"line 1, column 9: no element found; mend the XML"),
        ("<world/>", r"outermost element is <world>; give an MJCF, <mujoco>, a URDF, an SDF or a USD"),
        ('<!DOCTYPE m [<!ENTITY a "b">]><mujoco/>', r"line 1: declares a document type; remove it"),
        ('<mujoco><include file="../other.xml"/></mujoco>', r'<include file="../other.xml"> is outside the folder'),
        ('<mujoco><asset><mesh file="/etc/passwd"/></asset></mujoco>', r"outside the folder of the model"),
        (
            '<mujoco><compiler meshdir=".."/><asset><mesh file="a.stl"/></asset></mujoco>',
            r'<mesh file="a.stl"> is outside the folder',
        ),
    ],
)
def test_what_is_no_model_or_reaches_outside_is_refused(tmp_path, text, said):
    with pytest.raises(InputError, match=said):
        read_model_file(model(tmp_path, text))


def test_a_model_in_another_encoding_is_refused(tmp_path):
    file = tmp_path / "arm.xml"
    file.write_bytes("<mujoco/>".encode("utf-16"))
    with pytest.raises(InputError, match=r"arm\.xml, line 1: not UTF-8 text \(byte 1\); save it as UTF-8"):
        read_model_file(file)


def test_included_files_are_looked_at_too(tmp_path):
    (tmp_path / "part.xml").write_text('<mujocoinclude><include file="/etc/hosts"/></mujocoinclude>', encoding="utf-8")
    with pytest.raises(InputError, match=r"part\.xml: <include file=\"/etc/hosts\"> is outside"):
        read_model_file(model(tmp_path, '<mujoco><include file="part.xml"/></mujoco>'))


URDF = """<robot name="arm">
  <link name="base"/>
  <joint name="pan" type="revolute"><axis xyz="0 0 1"/><dynamics damping="1.0" friction='2'/></joint>
  <joint name="lift" type="revolute">
    <axis xyz="0 1 0"/>
  </joint>
</robot>
"""


def test_a_urdf_holds_damping_and_friction_in_dynamics_there_or_yet_to_come(tmp_path):
    file = read_model_file(model(tmp_path, URDF))
    assert file.is_urdf and file.holds("damping") and not file.holds("armature")
    (pan, damping), (lift, friction), (same, _) = (
        file.number(joint, name) for joint, name in (("pan", "damping"), ("lift", "frictionloss"), ("lift", "damping"))
    )
    assert (damping, friction, lift is same) == ("damping", "friction", True)
    new = file.changed({pan: {damping: 1.5}, lift: {friction: 0.25, "damping": 3.0}}).decode()
    assert new == URDF.replace('damping="1.0"', 'damping="1.5"').replace(
        '<joint name="lift" type="revolute">',
        '<joint name="lift" type="revolute"><dynamics friction="0.25" damping="3.0"/>',
    )
    assert file.changed({}) == URDF.encode()
