"""A package that brings an effect with its ontology: a bump that a joint is to be lifted over."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from tests import data_sets, synthetic

_CODE = '''"""A bump in a joint's way."""

from dataclasses import dataclass

import numpy as np

from irtwin.effects.effect import JointEffect, Term, force_unit


@dataclass(frozen=True)
class Bump(JointEffect):
    """k exp(-((q - 0.2) / 0.1)^2): a detent that holds the joint back."""

    id = "bump"
    family = "load"
    channel = "torque"

    def joint_terms(self, joint):
        return (Term("k", force_unit(joint), joint.name, spread=10.0),)

    def samples(self, robot, motion, predicted):
        return (np.exp(-(((motion.q - 0.2) / 0.1) ** 2)),)
'''
_ONTOLOGY = """@prefix irt: <https://w3id.org/irtwin#> . @prefix effect: <https://w3id.org/irtwin/effect/> .
@prefix owl: <http://www.w3.org/2002/07/owl#> . @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix unit: <http://qudt.org/vocab/unit/> . @prefix qudt: <http://qudt.org/schema/qudt/> .
@prefix skos: <http://www.w3.org/2004/02/skos/core#> .
<https://example.org/bump> a owl:Ontology ; owl:imports <https://w3id.org/irtwin> .
effect:bump a owl:NamedIndividual, irt:Effect ;
    rdfs:label "bump"@en ; skos:definition "A detent that holds a joint back at one angle."@en ;
    irt:Equation "k exp(-((q - 0.2) / 0.1)^2)" ; irt:has_Family <https://w3id.org/irtwin/family/load> ;
    irt:has_Channel <https://w3id.org/irtwin/channel/torque> ; irt:Acts_Per "joint" ;
    irt:Where_Seen "at one angle" ; irt:Baseline false ; irt:has_Effect_Parameter effect:bump.k .
effect:bump.k a owl:NamedIndividual, irt:Effect_Parameter ;
    rdfs:label "k of bump"@en ; irt:Parameter_Name "k" ; qudt:hasUnit unit:N-M ;
    skos:definition "Its height."@en ; irt:Range_Lower 0.1e0 ; irt:Range_Upper 50.0e0 .
"""


def install(place: Path) -> None:
    """Put the package and its entry points into a folder of installed packages."""
    (place / "bump_package/ontology").mkdir(parents=True)
    (place / "bump_package/__init__.py").write_text(_CODE)
    (place / "bump_package/ontology/bump.ttl").write_text(_ONTOLOGY)
    said = place / "bump_package-0.2.dist-info"
    said.mkdir()
    (said / "METADATA").write_text("Metadata-Version: 2.1\nName: bump-package\nVersion: 0.2\n")
    (said / "entry_points.txt").write_text(
        "[irtwin.effects]\nbump = bump_package:Bump\n[irtwin.extensions]\nbump = bump_package\n"
    )


def data_set(folder: Path) -> Path:
    """Write three runs of an arm of one joint with such a bump, of torque alone."""
    robot = replace(synthetic.with_constants(synthetic.arm(1)), name="Bumped")
    runs = []
    for seed in range(1, 4):
        motion = synthetic.measure(robot, synthetic.swing(robot, seed, seconds=10.0), noise=0.05, seed=seed)
        torque = motion.torque + 8.0 * np.exp(-(((motion.q - 0.2) / 0.1) ** 2))
        runs.append(synthetic.as_run(replace(motion, torque=torque, current=None, power=None)))
    return data_sets.write(folder, robot, runs)
