import pytest

from irtwin.errors import InputError
from irtwin.knowledge.explain.provenance import trace
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import ID, PROVIDER, individual


def test_number_is_followed_back_to_its_files(graph: KnowledgeGraph) -> None:
    steps = trace(graph, individual("joint_energy", "Arm_A.check_1", "j2"))
    assert [(step.depth, step.thing.removeprefix(ID), step.provider) for step in steps] == [
        (0, "joint_energy/Arm_A.check_1/j2", PROVIDER + "energy"),
        (1, "twin/Arm_A.t1", PROVIDER + "identification"),
        (2, "series/aa/Arm_A.fit_1", None),
    ]
    assert steps[-1].file == "series/aafit_1.parquet"
    assert steps[-1].checksum == "aafit_1"
    assert steps[0].software == "irtwin 0.1.0"


def test_run_has_a_step_for_each_activity_that_filled_it(graph: KnowledgeGraph) -> None:
    steps = trace(graph, individual("run", "Arm_A.check_1"))
    assert {step.provider for step in steps if step.depth == 0} == {PROVIDER + "run_state", PROVIDER + "energy"}


def test_thing_that_nobody_computed_ends_the_chain(graph: KnowledgeGraph) -> None:
    (step,) = trace(graph, individual("robot", "Arm_A"))
    assert (step.activity, step.file) == (None, None)


def test_unknown_thing_is_refused(graph: KnowledgeGraph) -> None:
    with pytest.raises(InputError, match="not in the graph"):
        trace(graph, individual("run", "nobody"))
