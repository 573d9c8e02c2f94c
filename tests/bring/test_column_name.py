"""Names as controllers and people write them: channel, unit and number."""

from __future__ import annotations

import pytest

from irtwin.bring.column_name import said_by


@pytest.mark.parametrize(
    ("name", "field", "unit", "numbers"),
    [
        ("actual_q_3", "q", None, (3,)),
        ("/joint_states/position[2]", "q", None, (2,)),
        ("Joint 1 angle (deg)", "q", "deg", (1,)),
        ("pos_deg_4", "q", "deg", (4,)),
        ("A1 Istposition [°]", "q", "deg", (1,)),
        ("J6", "q", None, (6,)),
        ("axis2_vel_rad_s", "dq", "rad/s", (2,)),
        ("vel_deg_per_s_1", "dq", "deg/s", (1,)),
        ("Drehzahl A3 [U/min]", "dq", "rpm", (3,)),
        ("J1 [deg/s]", "dq", "deg/s", (1,)),
        ("abs_encoder_angle_2", "q", None, (2,)),
        ("current_position_1", "q", None, (1,)),
        ("current_torque_1 [Nm]", "torque", "N m", (1,)),
        ("motorCurrent5_mA", "current", "mA", (5,)),
        ("Iq_1", "current", None, (1,)),
        ("motor_temperature_2_C", "temperature", "degC", (2,)),
        ("time_ms", "time", "ms", ()),
        ("__time", "time", None, ()),
        ("timestamp_ns", "time", "ns", ()),
        ("Wirkleistung [kW]", "power", "kW", ()),
        ("power_kW", "power", "kW", ()),
        ("dc bus voltage (V)", "meter_voltage", "V", ()),
        ("effort_6_kNm", "torque", "kN m", (6,)),
    ],
)
def test_a_name_says_channel_unit_and_number(name: str, field: str, unit: str | None, numbers: tuple[int, ...]) -> None:
    said = said_by(name)
    assert (said.field, said.unit and said.unit.name, said.numbers) == (field, unit, numbers)


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("target_q_0", "what was wanted"),
        ("Sollposition_A1 soll", "what was wanted"),
        ("tool_force_x", "of no joint"),
        ("digital_in_7", "no channel"),
        ("tau_abs_elbow", "a magnitude, without its sign"),
    ],
)
def test_what_was_not_measured_is_not_used(name: str, why: str) -> None:
    said = said_by(name)
    assert said.field is None
    assert why in said.why


def test_a_motors_angle_is_told_from_a_joints() -> None:
    assert said_by("motor_pos_1").motor
    assert not said_by("joint_pos_1").motor
