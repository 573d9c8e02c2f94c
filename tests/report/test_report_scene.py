import numpy as np
import pyarrow as pa
import pytest
from tests.virtual.scene_data import bare, embedded

from irtwin.errors import InputError
from irtwin.report.energy.scene import draw_scene
from irtwin.report.explorer import Columns

SERIES = {
    "time": [5.0, 6.0, 7.0],
    "q_turn": [0.0, 0.1, 0.2],
    "energy_model": [0.0, 50.0, 99.0],
    "power_model": [50.0] * 3,
}


def test_the_scene_performs_the_modelled_series_from_their_start():
    series = Columns.of(pa.table(SERIES | {"q_lift": [0.0, 0.0, 0.1]}))
    modelled = Columns.of(pa.table(SERIES | {"q_lift": [0.0, 0.0, 0.1], "tau_turn_model": [1.0, 2.0, 3.0]}))
    data = embedded(draw_scene(bare(), {}, [("first", series), ("second", modelled)], 1))
    assert data["opens"] == 1
    first, second = data["runs"]
    assert (first["name"], first["start"], first["torque"]) == ("first", 0.0, None)
    assert second["torque"][-1, 0] == pytest.approx(3.0) and np.isnan(second["torque"][:, 1]).all()


def test_a_series_without_a_joint_is_told():
    with pytest.raises(InputError, match="the series of a run has no column 'q_lift'"):
        draw_scene(bare(), {}, [("run", Columns.of(pa.table(SERIES)))], 0)
