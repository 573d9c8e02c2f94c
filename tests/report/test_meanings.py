"""Parameters of causes are told with what they mean."""

from tests import gap_cases

from irtwin.report.gap.meanings import meanings


def test_each_parameter_is_told_once_with_what_it_means():
    assert meanings(gap_cases.document("attributed")) == [
        "Fs of stribeck friction: Friction above Coulomb's at standstill.",
        "d of stribeck friction: Stribeck exponent.",
    ]


def test_where_nothing_is_to_blame_nothing_is_explained():
    assert meanings(gap_cases.document("no_gap")) == []
