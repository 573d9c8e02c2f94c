from tests.report.robots import answers, six_axis

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.report.energy import tables
from irtwin.report.questions import Answers


def test_joint_parameters_make_a_matrix_and_the_rest_lists(six_answers: Answers):
    parameters = tables.parameters(six_answers["parameters"].rows, six_answers["joints"].rows)
    assert [line.name for line in parameters.per_joint] == ["Fc", "Fv"]
    assert list(parameters.per_joint[0].cells) == list(parameters.joints)
    assert parameters.per_joint[0].cells["joint_1"].value == "7.14"
    assert parameters.per_joint[1].cells["joint_6"].unsure
    others = dict(parameters.others)
    assert [line.name for line in others["rigid-body dynamics"]][:3] == ["base_1", "base_2", "base_3"]
    assert [line.cell and line.cell.interval for line in others["standby power"]] == ["149.90 … 150.10"]


def test_what_goes_with_torque_has_a_second_interval(graph: KnowledgeGraph):
    found = answers(graph, six_axis(graph, scale_why="torque of drives comes from nominal constants"))
    parameters = tables.parameters(found["parameters"].rows, found["joints"].rows)
    cell = parameters.per_joint[0].cells["joint_1"]
    assert (cell.interval, cell.scaled) == ("7.04 … 7.24", "6.43 … 7.85")
    assert [line.cell and line.cell.scaled for line in dict(parameters.others)["standby power"]] == [None]


def test_conclusions_gather_what_they_are_about_and_who_drew_them(six_answers: Answers):
    by_label = {conclusion["label"]: conclusion for conclusion in tables.conclusions(six_answers["conclusions"].rows)}
    assert by_label["idle-heavy run"]["about"] == ["cycle_6"]
    assert by_label["dominant joint"]["about"] == ["cycle_6: joint_2"]
    assert by_label["twin to identify again"]["by"] == ["SWRL rules"]
