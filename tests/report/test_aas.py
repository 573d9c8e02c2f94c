"""Asset Administration Shells: what BaSyx' own strict reader finds in what is written."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from basyx.aas import model
from basyx.aas.adapter.aasx import AASXReader, DictSupplementaryFileContainer
from basyx.aas.adapter.json import read_aas_json_file
from tests.plants import HOSTILE

from irtwin.errors import InputError
from irtwin.location import Location
from irtwin.report.aas import export_shell


@pytest.fixture(scope="module")
def plant(plant_place: Path, tmp_path_factory: pytest.TempPathFactory) -> Location:
    return Location.of(Path(shutil.copytree(plant_place, tmp_path_factory.mktemp("aas") / "plant")))


def element(submodel: model.Submodel, *path: str | int) -> object:
    found: object = submodel
    for part in path:
        found = list(found.value)[part] if isinstance(part, int) else found.get_referable(part)  # type: ignore[attr-defined]
    return found.value  # type: ignore[attr-defined]


@pytest.mark.parametrize("suffix", ["json", "aasx"])
def test_nameplate_carbon_footprint_and_series_are_read_back(plant: Location, tmp_path: Path, suffix: str) -> None:
    out = tmp_path / f"arm.{suffix}"
    export_shell(out, plant, "Arm_A")
    if suffix == "json":
        store = read_aas_json_file(str(out), failsafe=False)
    else:
        store = model.DictIdentifiableStore()
        with AASXReader(str(out), failsafe=False) as reader:
            reader.read_into(store, DictSupplementaryFileContainer())
    (shell,) = [one for one in store if isinstance(one, model.AssetAdministrationShell)]
    assert shell.asset_information.global_asset_id == "https://w3id.org/irtwin/id/robot/Arm_A"
    plate, carbon, series = (
        next(it.resolve(store) for it in shell.submodel if it.resolve(store).id_short == name)
        for name in ("Nameplate", "CarbonFootprint", "TimeSeries")
    )
    assert element(plate, "ManufacturerName")["en"] == "Acme"  # type: ignore[index]
    (footprint,) = carbon.get_referable("ProductCarbonFootprints").value
    assert float(footprint.get_referable("PcfCO2eq").value) == pytest.approx(0.000511111, rel=1e-5)
    days = series.get_referable("Segments").get_referable("EnergyOfDays").get_referable("Records").value
    assert [day.get_referable("Energy").value for day in days] == pytest.approx([8.3333e-4, 4.4444e-4], rel=1e-4)
    assert min(day.get_referable("Time").value.isoformat() for day in days) == "2026-03-02T00:00:00+00:00"


def test_a_robot_with_a_hostile_name_and_without_energy_has_a_nameplate(plant: Location, tmp_path: Path) -> None:
    export_shell(tmp_path / "d.json", plant, HOSTILE)
    (plate,) = [
        it for it in read_aas_json_file(str(tmp_path / "d.json"), failsafe=False) if isinstance(it, model.Submodel)
    ]
    assert plate.id_short == "Nameplate"


def test_mistakes_are_told(plant: Location, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"--aas writes FILE\.aasx or FILE\.json"):
        export_shell(tmp_path / "a.xml", plant, "Arm_A")
    with pytest.raises(InputError, match="say which robot by --robot"):
        export_shell(tmp_path / "a.json", plant, None)
    with pytest.raises(InputError, match="No such file or directory"):
        export_shell(tmp_path / "none" / "a.aasx", plant, "Arm_A")
    assert not list(tmp_path.iterdir())
