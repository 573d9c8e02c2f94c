"""What the fields of a part tell becomes tables, columns and templates of IRIs."""

from __future__ import annotations

from collections.abc import Mapping

from irtwin.document.document import CauseId, Interval
from irtwin.document.tables import DOCUMENT, TABLES, Table, reached
from irtwin.document.told import part, tells, told
from irtwin.document.words import Channel, Effect, Joint, Run


@part()
class Why:
    reason: str = told("Reason")
    window: Interval | None = told("Acts_From", "Acts_Until", column="from_s until_s", default=None)


@part("Number", of="number_of", ranked=True)
class Number:
    value: float = told("Value")
    interval95: Interval = told("Value", optional=True)
    not_kept: float


@part("Share", of="share_in", unit_of="channel")
class Share:
    share: float = told("Share")


@part("Fault", table="gap_fault", of="fault_of", ranked=True)
class Fault:
    id: str = told(column="fault_id", key=True)
    joints: tuple[Joint, ...] = told("fault_in_Joint")
    runs: tuple[Run, ...] | None = told("seen_in_Run", table="gap_seen", default=None)
    either: tuple[Effect, ...] = told("by_Effect", "or_Effect", column="effect rival")
    why: Why | None = told()
    numbers: tuple[Number, ...] = told()
    shares: Mapping[Channel, Share] = told("in_Channel")
    by: CauseId | None = told("caused_by")

    @property
    @tells("Length")
    def length(self) -> float:
        return float(len(self.id))


@part("Whole")
class Whole:
    faults: tuple[Fault, ...] = told()
    notes: tuple[str, ...]


FAULT, JOINTS, RUNS, NUMBER, SHARE = Table("whole", Whole).parts[0].all()


def test_parts_have_tables_and_so_have_lists_of_names() -> None:
    tables = {one.name: one.keys for one in (FAULT, JOINTS, RUNS, NUMBER, SHARE)}
    of_fault = ("diagnosis_id", "fault_id")
    assert tables == {
        "gap_fault": of_fault,
        "gap_fault_joint": (*of_fault, "joint"),
        "gap_seen": (*of_fault, "run_id"),
        "number": (*of_fault, "number"),
        "share": (*of_fault, "channel"),
    }


def test_what_is_told_is_a_column() -> None:
    columns = [(column.name, column.kind, column.nullable, column.term) for column in FAULT.columns]
    assert columns == [
        ("rank", int, False, "Rank"),
        ("fault_id", str, False, ""),
        ("effect", str, False, "by_Effect"),
        ("rival", str, True, "or_Effect"),
        ("reason", str, True, "Reason"),  # the part that has it may be missing
        ("from_s", float, True, "Acts_From"),
        ("until_s", float, True, "Acts_Until"),
        ("cause_id", str, True, "caused_by"),
        ("length", float, False, "Length"),
    ]
    assert [(one.name, one.nullable, one.term) for one in NUMBER.columns] == [
        ("number", False, "Rank"),
        ("value", False, "Value"),
        ("lower", True, "Value_Lower"),
        ("upper", True, "Value_Upper"),
    ]
    assert [(one.name, one.term, one.unit_of) for one in SHARE.columns] == [
        ("channel", "in_Channel", ""),
        ("share", "Share", ""),
        ("unit", "", "channel"),
    ]


def test_iris_end_in_what_tells_parts_apart() -> None:
    assert FAULT.iri == JOINTS.iri == "fault/{diagnosis_id}/{fault_id}"
    assert NUMBER.iri == "number/{diagnosis_id}/{fault_id}/{number}"


def test_rows_of_parts_that_name_joints_say_the_robot() -> None:
    assert [one.of_robot for one in (FAULT, JOINTS, RUNS, NUMBER, SHARE)] == [True, True, False, False, False]
    assert not DOCUMENT.of_robot


def test_a_value_is_reached_or_something_is_missing_on_the_way() -> None:
    said = {"id": "abc", "joints": (), "either": ("backlash",), "numbers": (), "shares": {}, "by": None}
    without = Fault(why=None, **said)
    with_all = Fault(why=Why(reason="", window=(1.0, 2.0)), **said)
    steps = {column.name: column.steps for column in FAULT.columns}
    found = {name: (reached(without, way), reached(with_all, way)) for name, way in steps.items()}
    assert found["fault_id"] == ("abc", "abc")
    assert found["until_s"] == (None, 2.0)
    assert (found["effect"], found["rival"]) == (("backlash", "backlash"), (None, None))
    assert found["length"] == (3.0, 3.0)


def test_the_tables_of_a_diagnosis() -> None:
    assert len({table.name for table in TABLES}) == len(TABLES) > 25
