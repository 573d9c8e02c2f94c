"""The thresholds: each is told, each can be changed, and what is changed decides."""

import dataclasses
import re
from pathlib import Path

import pytest

import irtwin.gap
from irtwin.errors import InputError
from irtwin.gap.thresholds import DEFAULT, Thresholds

DECISIONS = Path(__file__).parents[2] / "docs"
NAMES = [one.name for one in DEFAULT.listed()]


def test_each_has_a_meaning_a_unit_and_an_origin():
    for one in DEFAULT.listed():
        assert one.meaning and one.unit and one.source, one.name
        if one.source.startswith("decisions/"):
            assert (DECISIONS / one.source).is_file(), one.name


@pytest.mark.parametrize("name", NAMES)
def test_the_code_reads_each(name):
    own = name.split(".")[1]
    folder = Path(irtwin.gap.__file__).parent
    text = "".join(file.read_text() for file in folder.rglob("*.py") if file.name != "thresholds.py")
    assert re.search(rf"\.{own}\b", text)


def test_one_is_changed_and_the_others_stay():
    changed = DEFAULT.changed("criterion.misfit", 3.0)
    assert changed.criterion.misfit == 3.0
    assert dataclasses.replace(changed, criterion=DEFAULT.criterion) == Thresholds() == DEFAULT


@pytest.mark.parametrize("name", ["criterion.least", "misfit", "criterion", "criterion.", ""])
def test_an_unknown_name_is_refused(name):
    with pytest.raises(InputError, match=f'there is no threshold "{re.escape(name)}"; choose from data.shortest'):
        DEFAULT.changed(name, 1.0)


def test_they_cannot_be_changed_in_place():
    with pytest.raises(dataclasses.FrozenInstanceError):
        DEFAULT.criterion.misfit = 1.0


@pytest.mark.parametrize(("hypotheses", "least"), [(1, 0.0), (40, 0.023), (240, 0.040)])
def test_the_more_hypotheses_the_more_an_effect_has_to_show(hypotheses, least):
    assert DEFAULT.criterion.visible(hypotheses) == pytest.approx(least, abs=0.001)
