"""The friction of each joint on the gap page."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from tests import gap_cases
from tests.gap_pages import figures_of, page_of

from irtwin.report.gap.friction import figures, table

CURVES = gap_cases.curves("attributed").friction or ()


def named(figure: dict[str, Any]) -> list[str]:
    return [trace["name"] for trace in figure["data"] if "name" in trace]


def test_joints_stand_in_order_and_a_changed_one_has_both_sides():
    drawn = figures(CURVES)
    assert list(drawn) == ["joint_a1", "joint_a3"]
    assert [named(one) for one in drawn.values()] == [["observed"], ["reference", "observed"]]
    assert [one["layout"]["showlegend"] for one in drawn.values()] == [False, True]


def test_a_figure_has_band_curve_and_points_with_their_units():
    low, high, curve, points = figures(CURVES)["joint_a1"]["data"]
    assert (low["y"], high["y"], curve["y"]) == ([-2.1, -0.1, 1.9], [-1.8, 0.2, 2.2], [-2.0, 0.0, 2.0])
    assert points["y"] == pytest.approx([-1.95, 0.05, 2.05])
    assert points["error_y"]["array"] == pytest.approx([0.15] * 3)
    assert points["error_y"]["arrayminus"] == pytest.approx([0.15] * 3)
    layout = figures(CURVES)["joint_a1"]["layout"]
    assert [layout[axis]["title"]["text"] for axis in ("xaxis", "yaxis")] == ["speed, rad/s", "friction, N m"]


def test_each_number_of_each_side_has_a_line():
    lines = table(CURVES, {"coulomb_friction": "Coulomb's"})
    assert [(line.label, line.name, line.unit, set(line.cells)) for line in lines] == [
        ("Coulomb's, reference", "Fc", "N m", {"joint_a3"}),
        ("Coulomb's, observed", "Fc", "N m", {"joint_a1", "joint_a3"}),
    ]
    assert (lines[1].cells["joint_a3"].value, lines[1].cells["joint_a3"].interval) == ("1.50", "1.38 … 1.62")
    assert [line.label for line in table(CURVES[1:], {})] == ["coulomb friction"]  # one side needs no name


@pytest.mark.slow
def test_the_page_has_a_plot_a_joint_and_the_numbers(tmp_path: Path):
    page = page_of(tmp_path, gap_cases.diagnosis("attributed"))
    drawn = [name for name in figures_of(tmp_path / "p.html") if name.startswith("friction")]
    assert sorted(drawn) == ["friction_0", "friction_1"]
    section = re.search(r'<section id="friction".*?</section>', page, re.DOTALL)
    for said in ("Friction of joint_a3", "Coulomb friction, reference", "1.38 … 1.62", "that of the reference runs"):
        assert said in section[0]
