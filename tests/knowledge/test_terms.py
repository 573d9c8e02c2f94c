"""Which terms of the project users may use in what they assert."""

from __future__ import annotations

import pytest
from pyoxigraph import Quad
from tests.knowledge.graphs import turtle

from irtwin.errors import InputError
from irtwin.knowledge.asserted.terms import check
from irtwin.resources import shipped


def checked(text: str) -> None:
    (triple,) = turtle(f"@base <http://x/> . {text} .")
    check(shipped(), Quad(*triple), text)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("<run> irt:Paylod 5", r"the ontology has no irt:Paylod: did you mean irt:Payload\? A term of your own"),
        ("<run> irt:in_Cell <cell>", "the ontology has no irt:in_Cell"),
        ("<run> a irt:Wastefull_Run", r"did you mean irt:Wasteful_Run\?"),
        ("irt:My_Class a owl:Class", "A term of your own has a namespace of your own"),
        ("limit:idle_shar irt:Limit_Value 0.1", r"did you mean limit:idle_share\?"),
        ("<run> a irt:Overloaded_Run", "irt:Overloaded_Run is concluded; change what it is concluded from"),
        ("<robot> a irt:Robot_Without_Twin", "irt:Robot_Without_Twin is concluded"),
        ("<run> irt:exceeds limit:payload_share", "irt:exceeds is concluded"),
        ("<robot> irt:Yearly_Saving 5.0e0", "irt:Yearly_Saving is concluded"),
    ],
)
def test_terms_that_do_not_exist_or_are_concluded_are_refused(text: str, why: str) -> None:
    with pytest.raises(InputError, match=why):
        checked(text)


@pytest.mark.parametrize(
    "text",
    [
        "<action> a irt:Saving_Action",
        "<action> irt:saves_at <robot>",
        "<tariff> irt:Currency 'EUR'",
        "<run> a <urn:Night_Shift>",
        "<robot> a irt:Industrial_Robot",
        "irt:Payload rdfs:comment 'as the controller is told'",
    ],
)
def test_what_people_say_is_taken(text: str) -> None:
    checked(text)
