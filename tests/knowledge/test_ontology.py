"""The ontology and what is written in its terms; the rules of `rules/hygiene/` are held in test_hygiene.py."""

import re
import tomllib
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
import rdflib
from rdflib.namespace import OWL, RDF

from irtwin.resources import folder

IRT = rdflib.Namespace("https://w3id.org/irtwin#")
EFFECT = "https://w3id.org/irtwin/effect/"
QUDT = rdflib.Namespace("http://qudt.org/schema/qudt/")
MODULES = sorted(file.stem for file in folder("ontology").glob("*.ttl"))
KINDS = [OWL.Class, OWL.ObjectProperty, OWL.DatatypeProperty, OWL.AnnotationProperty, OWL.NamedIndividual]
SHARED = Path(__file__).parents[2] / "../shared"


@pytest.fixture(scope="module")
def ontology() -> rdflib.Graph:
    graph = rdflib.Graph()
    for module in MODULES:
        graph.parse(folder("ontology") / f"{module}.ttl")
    return graph


def own_terms(ontology: rdflib.Graph) -> set[rdflib.URIRef]:
    return {term for kind in KINDS for term in ontology.subjects(RDF.type, kind) if str(term).startswith(IRT[""][:-1])}


def local(terms) -> set[str]:
    return {str(term).removeprefix(str(IRT)) for term in terms}


def test_seed_terms_keep_their_names(ontology: rdflib.Graph) -> None:
    seed = """Industrial_Robot IR_Information IR_RunProcess IR_Name IR_ID IR_Type Manufacturer IR_Weight Controlled_Axes
        Arm_Movement_Type Current_State Joint_Position Joint_Speed Joint_Acc Joint_Torque Payload Run_Power
        Energy_Consumption Run_Time"""
    assert set(seed.split()) <= local(own_terms(ontology))


def test_every_term_that_is_used_is_declared(ontology: rdflib.Graph) -> None:
    declared = local(own_terms(ontology))
    texts = [
        *Path(folder("ontology")).glob("**/*.ttl"),
        *(file for file in folder("rules").rglob("*") if file.is_file()),
        *folder("mappings").glob("*.ttl"),
        *folder("reports").glob("**/*.rq"),
        *(Path(__file__).parents[2] / "src/irtwin/knowledge/questions").glob("*.rq"),
        *Path(__file__).parent.glob("data/*.trig"),
    ]
    for file in texts:
        used = set(re.findall(r"\birt:(\w+)", file.read_text(encoding="utf-8")))
        assert used - declared == set(), file.name


@pytest.mark.parametrize("catalogue", ["catalog-v001.xml", "robots/catalog-v001.xml", "alignments/catalog-v001.xml"])
def test_catalogue_finds_every_import(catalogue: str) -> None:
    file = folder("ontology") / catalogue
    found = {}
    for element in ElementTree.parse(file).getroot():
        target = file.parent / (element.get("uri") or element.get("catalog") or "")
        assert target.is_file()
        found[element.get("name")] = target
    if "/" in catalogue:
        return
    for target in found.values():
        for imported in rdflib.Graph().parse(target).objects(None, OWL.imports):
            assert str(imported) in found


def test_effects_are_linked_to_effects(ontology: rdflib.Graph) -> None:
    effects = set(ontology.subjects(RDF.type, IRT.Effect))
    assert all(str(effect).startswith(EFFECT) for effect in effects)
    for effect in effects:
        assert set(ontology.objects(effect, IRT.confused_with)) <= effects - {effect}
        for name in ("Equation", "has_Channel", "Acts_Per", "Where_Seen", "Baseline"):
            assert len(list(ontology.objects(effect, IRT[name]))) == 1
    for parameter in ontology.subjects(RDF.type, IRT.Effect_Parameter):
        effect = ontology.value(predicate=IRT.has_Effect_Parameter, object=parameter)
        assert effect in effects
        if not str(ontology.value(effect, IRT.has_Channel)).endswith("/position"):  # a simulator's servo has its own
            low, high = (float(ontology.value(parameter, IRT[name])) for name in ("Range_Lower", "Range_Upper"))
            assert low < high


# Two masses and a spring stand for these, not the contract's shorter formula: see `irtwin.effects.compliance`.
FITTED_OTHERWISE = {"backlash", "joint_elasticity"}
# Beyond the contract: what does not repeat is a gap too, and has effects of its own.
OWN_PARAMETERS = {"holding_brakes": {"delay", "lead"}}
OWN_EFFECTS = {"periodic_disturbance", "switching_load", "local_wear", "joint_limit_spring"}


@pytest.mark.system
@pytest.mark.skipif(not (SHARED / "contract/effects.toml").exists(), reason="the shared list of effects is absent")
def test_effects_are_those_of_the_contract(ontology: rdflib.Graph) -> None:
    contract = tomllib.loads((SHARED / "contract/effects.toml").read_text(encoding="utf-8"))
    symbols = {"Nm": "N m", "Nm s/rad": "N m s/rad", "Nm/rad": "N m/rad", "Nm/s": "N m/s"}
    played = set(ontology.subjects(IRT.has_Channel, rdflib.URIRef("https://w3id.org/irtwin/channel/position")))
    every = set(ontology.subjects(RDF.type, IRT.Effect)) - played
    effects = {str(effect).removeprefix(EFFECT) for effect in every}
    assert effects - OWN_EFFECTS == set(contract)
    for name, said in contract.items():
        effect = rdflib.URIRef(EFFECT + name)
        assert (str(ontology.value(effect, IRT.Equation)) == said["equation"]) == (name not in FITTED_OTHERWISE)
        assert str(ontology.value(effect, IRT.has_Channel)).endswith("/" + said["channel"])
        assert str(ontology.value(effect, IRT.Acts_Per)) == said["per"]
        assert str(ontology.value(effect, IRT.Where_Seen)) == said["where"]
        assert ontology.value(effect, IRT.Baseline).toPython() == said.get("baseline", False)
        rivals = {str(other).removeprefix(EFFECT) for other in ontology.objects(effect, IRT.confused_with)}
        assert rivals == set(said.get("confused_with", []))
        parameters = {}
        own = {rdflib.URIRef(f"{EFFECT}{name}.{each}") for each in OWN_PARAMETERS.get(name, ())}
        for parameter in set(ontology.objects(effect, IRT.has_Effect_Parameter)) - own:
            unit = str(ontology.value(ontology.value(parameter, QUDT.hasUnit), QUDT.symbol))
            ends = [float(ontology.value(parameter, IRT[end])) for end in ("Range_Lower", "Range_Upper")]
            parameters[str(ontology.value(parameter, IRT.Parameter_Name))] = [unit, *ends]
        expected = {key: [symbols.get(unit, unit), *ends] for key, (unit, *ends) in said.get("parameters", {}).items()}
        assert parameters == expected


def test_kr6_sheet_says_what_its_urdf_says() -> None:
    robots = folder("ontology") / "robots"
    sheet = rdflib.Graph().parse(robots / "kuka_kr6_r700.ttl")
    robot = rdflib.URIRef("https://w3id.org/irtwin/id/robot/KUKA_KR6_R700")
    information = sheet.value(robot, IRT.has_Information)
    for name, value in {"Controlled_Axes": 6, "IR_Weight": 50.0, "Rated_Payload": 6.0}.items():
        assert sheet.value(information, IRT[name]).toPython() == value
    described = ElementTree.parse(robots / "kuka_kr6_r700.urdf").iter("joint")
    joints = [joint for joint in described if joint.get("type") != "fixed"]
    assert len(joints) == len(list(sheet.objects(robot, IRT.has_Joint))) == 6
    for number, joint in enumerate(joints, start=1):
        individual = rdflib.URIRef(f"https://w3id.org/irtwin/id/joint/KUKA_KR6_R700/{joint.get('name')}")
        limit = joint.find("limit")
        assert limit is not None
        assert sheet.value(individual, IRT.Joint_Number).toPython() == number
        pairs = {"lower": "Lower_Limit", "upper": "Upper_Limit", "velocity": "Speed_Limit", "effort": "Torque_Limit"}
        for attribute, name in pairs.items():
            assert sheet.value(individual, IRT[name]).toPython() == float(limit.get(attribute, "nan"))


def test_kr6_sheet_says_what_the_shipped_data_set_says() -> None:
    sheet = rdflib.Graph().parse(folder("ontology") / "robots" / "kuka_kr6_r700.ttl")
    robot = tomllib.loads((folder("demo") / "kuka_kr6_r700" / "dataset.toml").read_text(encoding="utf-8"))["robot"]
    keys = {"IR_Name": "name", "IR_Type": "type", "IR_Weight": "weight"}
    for name, key in (keys | {"Manufacturer": "manufacturer", "Rated_Payload": "rated_payload"}).items():
        assert [value.toPython() for value in sheet.objects(None, IRT[name])] == [robot[key]]


def test_every_implemented_effect_has_an_individual(ontology: rdflib.Graph) -> None:
    catalogue = pytest.importorskip("irtwin.effects.catalogue")
    ids = {str(one).removeprefix(EFFECT) for one in ontology.subjects(RDF.type, IRT.Effect)}
    assert set(catalogue.catalogue()) <= ids
    baseline = {str(one).removeprefix(EFFECT) for one in ontology.subjects(IRT.Baseline, rdflib.Literal(True))}
    assert set(catalogue.BASELINE) == baseline
