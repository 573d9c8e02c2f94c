"""An effect is one place: nothing outside its class knows it by its id."""

import ast
from pathlib import Path

import pytest

import irtwin
from irtwin.effects import catalogue as module
from irtwin.effects.catalogue import catalogue
from irtwin.effects.drive import IronLoss

SOURCE = Path(irtwin.__file__).parent
# words that happen to be an effect's id as well
OTHER_MEANINGS = {
    "bring/data_set_text.py": {"rotor_inertia"},  # a key of the data sheet
    "bring/rtde_names.py": {"payload"},  # a column of a recording
    "demo/plant/arm.py": {"payload"},  # a body of the plant
    "demo/plant/machine.py": {"rotor_inertia"},  # a number of its drawings
    "gap/localisation/operating_variable.py": {"mechanical_power"},  # what a residual follows
    "gap/localisation/locations.py": {"mechanical_power"},
    "identification/programmes.py": {"payload"},  # a kind of programme
    "providers/records.py": {"rotor_inertia"},  # a joint's field
    "report/gap/experiment.py": {"payload"},
    "live/joint_stream.py": {"payload"},  # a field of a message
    "signals/log.py": {"rotor_inertia"},  # a key of the data sheet
    "simulator/fit.py": {"payload"},  # a number of a model, told as the effect of that name
    "simulator/servos.py": {"payload", "base_tilt"},
    "simulator/sysid.py": {"payload"},
    "simulator/writing.py": {"payload"},
    "twin/files.py": {"rotor_inertia"},
}
FAMILIES = {"bodies", "friction", "transmission", "load", "environment", "sensing", "drive", "supply"}


def texts(file: Path) -> set[str]:
    tree = ast.parse(file.read_text(encoding="utf-8"))
    return {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)}


@pytest.mark.slow
def test_no_other_room_knows_an_effect_by_its_id():
    files = {file.relative_to(SOURCE).as_posix(): file for file in SOURCE.rglob("*.py")}
    others = {name: file for name, file in files.items() if not name.startswith("effects/")}
    known = {name: texts(file) & catalogue().keys() - OTHER_MEANINGS.get(name, set()) for name, file in others.items()}
    assert {name: ids for name, ids in known.items() if ids} == {}


def test_every_effect_says_its_family():
    assert {effect.family for effect in catalogue().values()} == FAMILIES


class Installed:
    """An entry point of another package."""

    name = "eddy_brake"

    def __init__(self, kind):
        self.kind = kind

    def load(self):
        return self.kind


@pytest.fixture
def install(monkeypatch):
    def registered(kind):
        module._registered.cache_clear()
        monkeypatch.setattr(module, "entry_points", lambda group: [Installed(kind)] if group == module.GROUP else [])

    yield registered
    module._registered.cache_clear()


def test_another_package_brings_an_effect(install):
    class EddyBrake(IronLoss):
        id = "eddy_brake"

    install(EddyBrake)
    assert isinstance(catalogue()["eddy_brake"], EddyBrake)


def test_two_effects_of_one_id_are_a_mistake_of_their_packages(install):
    install(IronLoss)
    with pytest.raises(ValueError, match="two effects are called iron_loss"):
        catalogue()
