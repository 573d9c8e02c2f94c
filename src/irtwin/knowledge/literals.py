"""Literals as description-logic reasoners read them."""

from __future__ import annotations

import re

from pyoxigraph import Literal, Triple

from irtwin.knowledge.vocabulary import XSD

_BEYOND_MILLISECONDS = re.compile(r"(\.\d{3})\d+")


def to_milliseconds(triple: Triple) -> Triple:
    """Cut an xsd:dateTime to milliseconds: HermiT takes a time with more digits for malformed and stops."""
    value = triple.object
    if not isinstance(value, Literal) or value.datatype.value != XSD + "dateTime":
        return triple
    cut = Literal(_BEYOND_MILLISECONDS.sub(r"\1", value.value), datatype=value.datatype)
    return Triple(triple.subject, triple.predicate, cut)
