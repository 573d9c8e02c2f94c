"""Values of literals, by the examples of the W3C's specifications of XML Schema and OWL 2."""

import pytest

from irtwin.knowledge.owl_rl.datatypes import IllTyped, datatypes_of, is_datatype, value
from irtwin.knowledge.vocabulary import RDF, XSD


@pytest.mark.parametrize(
    ("datatype", "one", "other"),
    [
        ("integer", "42", "+042"),
        ("decimal", "-0.0", "0"),
        ("decimal", "3.1410", "03.141"),
        ("double", "0.31410E+01", "3.141"),
        ("double", "NaN", "NaN"),
        ("float", "16777217", "16777216"),
        ("boolean", "1", "true"),
        ("hexBinary", "0fb7", "0FB7"),
        ("dateTime", "2009-04-21T12:30:15", "2009-04-21T12:30:15.00"),
        ("dateTime", "2009-04-20T24:00:00Z", "2009-04-21T00:00:00+00:00"),
        ("dateTime", "-0400-02-29T00:00:00", "-0400-02-29T00:00:00.0"),
    ],
)
def test_one_value_in_two_writings(datatype: str, one: str, other: str) -> None:
    assert value(one, XSD + datatype) == value(other, XSD + datatype) is not None


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (("1", "integer"), ("1", "double")),
        (("1", "float"), ("1", "double")),
        (("0.0", "double"), ("-0.0", "double")),
        (("00", "hexBinary"), ("AA==", "base64Binary")),
        (("http://a", "anyURI"), ("http://a", "string")),
        (("1956-06-25T04:00:00-05:00", "dateTime"), ("1956-06-25T10:00:00+01:00", "dateTime")),
        (("0." + "0" * 60 + "1", "decimal"), ("0." + "0" * 60 + "2", "decimal")),
    ],
)
def test_two_values(one: tuple[str, str], other: tuple[str, str]) -> None:
    assert value(one[0], XSD + one[1]) != value(other[0], XSD + other[1])


@pytest.mark.parametrize(
    ("datatype", "text"),
    [
        ("integer", "4.0"),
        ("integer", " 4 "),
        ("byte", "128"),
        ("unsignedLong", str(2**64)),
        ("decimal", "1e3"),
        ("double", "1e310"),
        ("double", "1e-330"),
        ("float", "1e40"),
        ("double", "infinity"),
        ("boolean", "TRUE"),
        ("hexBinary", "abc"),
        ("base64Binary", "T(1)d#M"),
        ("dateTime", "2009-04-21"),
        ("dateTime", "2009-02-29T00:00:00"),
        ("dateTime", "2009-02-28T24:00:01"),
        ("dateTime", "2009-02-28T23:59:60"),
        ("dateTime", "9" * 5000 + "-02-28T23:59:00"),
        ("dateTime", "2009-02-28T23:59:00+14:01"),
        ("dateTimeStamp", "2009-04-21T12:30:15"),
        ("anyURI", ":abc"),
        ("language", "en-"),
        ("token", " a"),
        ("normalizedString", "a\tb"),
        ("Name", ".tag"),
        ("NCName", "a:b"),
    ],
)
def test_text_that_is_not_of_its_datatype(datatype: str, text: str) -> None:
    with pytest.raises(IllTyped):
        value(text, XSD + datatype)


def test_texts_with_and_without_language() -> None:
    assert value("a@de", RDF + "PlainLiteral") == value("a", RDF + "langString", "DE")
    assert value("a@", RDF + "PlainLiteral") == value("a", XSD + "string")
    assert value("a", XSD + "token") == value("a", XSD + "string")
    with pytest.raises(IllTyped):
        value("a", RDF + "PlainLiteral")
    with pytest.raises(IllTyped):
        value("<a", RDF + "XMLLiteral")


def test_datatypes_that_contain_a_value() -> None:
    def names(text: str, datatype: str) -> set[str]:
        known = value(text, XSD + datatype)
        assert known is not None
        return {one.rpartition("#")[2] for one in datatypes_of(known)} - {"Literal"}

    assert {"decimal", "integer", "byte", "unsignedByte", "positiveInteger"} <= names("7.0", "decimal")
    assert names("7.5", "decimal") == {"decimal"}
    assert "nonPositiveInteger" in names("0", "integer")
    assert names("7e0", "double") == {"double"}
    assert names("de", "string") == names("de", "language")
    assert "token" not in names(" ", "string")
    assert names("2009-04-21T12:30:15", "dateTime") == {"dateTime"}
    assert names("2009-04-21T12:30:15Z", "dateTime") == {"dateTime", "dateTimeStamp"}


def test_datatypes_that_owl_2_rl_does_not_know() -> None:
    assert value("x", "https://example.org/mine") is None
    assert not is_datatype("https://example.org/mine")
    assert is_datatype(RDF + "langString")
