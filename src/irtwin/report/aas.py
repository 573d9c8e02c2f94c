"""A robot as an Asset Administration Shell (AASX or JSON): nameplate, carbon footprint and energy a day.

Elements and semantic ids are those of IDTA's templates 02006-3-0, 02023-1-0 and 02008-1-1, as far as the graph knows
them: of what these ask for, address and serial number, methods and phases of the footprint are not known.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterable
from datetime import UTC, date, datetime, time
from decimal import Decimal
from pathlib import Path
from typing import Any

from irtwin.asking import open_graph
from irtwin.errors import InputError
from irtwin.knowledge.questions.queries import ask, robot_named
from irtwin.knowledge.store.table import Row
from irtwin.location import Location

try:
    from basyx.aas import model
    from basyx.aas.adapter.aasx import AASXWriter, DictSupplementaryFileContainer
    from basyx.aas.adapter.json import write_aas_json_file
except ModuleNotFoundError as error:
    raise InputError("--aas needs the package basyx-python-sdk; pip install 'irtwin[aas]'") from error

_IDTA = "https://admin-shell.io/idta"
_CARBON, _SERIES = f"{_IDTA}/CarbonFootprint", f"{_IDTA}/TimeSeries"


def export_shell(out: Path, location: Location, robot: str | None) -> None:
    """Write a robot of the graph, by its name, the only one's where None, as FILE.aasx or FILE.json.

    Raises InputError where there is no such robot, or no place to write.
    """
    if out.suffix.lower() not in (".aasx", ".json"):
        raise InputError(f"{out}: --aas writes FILE.aasx or FILE.json")
    with open_graph(location) as graph:
        iri = robot_named(graph, robot)
        (sheet,) = ask(graph, "robots", robot)
        name = sheet["robot"]
        costs, days = ask(graph, "energy_cost", name), ask(graph, "energy_per_day", name)
    submodels = [_nameplate(iri, sheet), *(_carbon(iri, row) for row in costs if row["CO2_kg"] is not None)]
    submodels += [_energy(iri, days)] if len(days) else []
    shell = model.AssetAdministrationShell(
        model.AssetInformation(model.AssetKind.INSTANCE, global_asset_id=iri, asset_type=sheet["type"]),
        f"{iri}/aas",
        id_short=re.sub(r"\W", "_", f"Robot_{name}", flags=re.ASCII)[:128].rstrip("_"),
        submodel={model.ModelReference.from_referable(submodel) for submodel in submodels},
    )
    store: Any = model.DictIdentifiableStore([shell, *submodels])
    written = io.BytesIO()  # whole before the file is touched
    if out.suffix.lower() == ".json":
        write_aas_json_file(written, store)
    else:
        with AASXWriter(written) as writer:
            writer.write_aas(shell.id, store, DictSupplementaryFileContainer())
    try:
        out.write_bytes(written.getvalue())
    except OSError as error:
        raise InputError(f"{out}: {error.strerror or error}") from error


def _nameplate(iri: str, sheet: Row) -> model.Submodel:
    product = _property("URIOfTheProduct", model.datatypes.AnyURI(iri), "0112/2///61987#ABN590#002")
    named = (
        ("ManufacturerName", sheet["manufacturer"], "0112/2///61987#ABA565#009"),
        ("ManufacturerProductDesignation", sheet["robot"], "0112/2///61987#ABA567#009"),
    )
    texts = [
        model.MultiLanguageProperty(key, _english(text), semantic_id=_means(meaning))
        for key, text, meaning in named
        if text
    ]
    return _submodel(iri, "Nameplate", f"{_IDTA}/nameplate/3/0/Nameplate", [product, *texts])


def _carbon(iri: str, row: Row) -> model.Submodel:
    """Return the carbon footprint of the energy of all runs, at the factor of `plant.toml`."""
    footprint = model.SubmodelElementCollection(
        None,
        [
            _property("PcfCO2eq", Decimal(str(row["CO2_kg"])), "0173-1#02-ABG855#003"),
            _property("ReferenceImpactUnitForCalculation", "kWh", "0173-1#02-ABG856#003"),
            _property("QuantityOfMeasureForCalculation", row["energy_kWh"], "0173-1#02-ABG857#003"),
        ],
        semantic_id=_means(f"{_CARBON}/ProductCarbonFootprint/1/0"),
    )
    footprints = model.SubmodelElementList(
        "ProductCarbonFootprints",
        model.SubmodelElementCollection,
        [footprint],
        semantic_id=_means(f"{_CARBON}/ProductCarbonFootprints/1/0"),
    )
    return _submodel(iri, "CarbonFootprint", f"{_CARBON}/CarbonFootprint/1/0", [footprints])


def _energy(iri: str, days: Iterable[Row]) -> model.Submodel:
    """Return the energy of each day (UTC), kWh, as one segment of a time series."""

    def record(key: str, at: datetime | None, energy: float | None) -> model.SubmodelElementCollection:
        values = [
            model.Property("Time", model.datatypes.DateTime, at, semantic_id=_means(f"{_SERIES}/UtcTime/1/1")),
            model.Property("Energy", model.datatypes.Double, energy, description=_english("electrical energy, kWh")),
        ]
        return model.SubmodelElementCollection(key, values, semantic_id=_means(f"{_SERIES}/Record/1/1"))

    def collection(key: str, meaning: str, parts: Iterable[model.SubmodelElement]) -> model.SubmodelElementCollection:
        return model.SubmodelElementCollection(key, parts, semantic_id=_means(f"{_SERIES}/{meaning}/1/1"))

    records = []
    for row in days:
        day = datetime.combine(date.fromisoformat(str(row["day"])), time(), UTC)
        records.append(record(f"Day_{day:%Y_%m_%d}", day, row["energy_kWh"]))
    segment = collection("EnergyOfDays", "Segments/InternalSegment", [collection("Records", "Records", records)])
    parts = [
        collection("Metadata", "Metadata", [record("Record", None, None)]),
        collection("Segments", "Segments", [segment]),
    ]
    return _submodel(iri, "TimeSeries", f"{_SERIES}/1/1", parts)


def _submodel(iri: str, name: str, meaning: str, elements: Iterable[model.SubmodelElement]) -> model.Submodel:
    return model.Submodel(f"{iri}/submodel/{name}", elements, id_short=name, semantic_id=_means(meaning))


def _property(name: str, value: Any, meaning: str) -> model.Property:
    return model.Property(name, type(value), value, semantic_id=_means(meaning))


def _means(identifier: str) -> model.ExternalReference:
    return model.ExternalReference((model.Key(model.KeyTypes.GLOBAL_REFERENCE, identifier),))


def _english(text: str) -> model.MultiLanguageTextType:
    return model.MultiLanguageTextType({"en": text})
