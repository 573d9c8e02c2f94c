"""The settings in a workspace's folder, as somebody else may have written them."""

from __future__ import annotations

import numpy as np
from tests.fuzz.values import odd, some

FILES = ("plant.toml", "alarms.toml")
_KEYS = {
    "plant.toml": ("price_per_kwh", "currency", "co2_kg_per_kwh", "base_iri", "x", "price"),
    "alarms.toml": ("mqtt", "sparkplug", "password_env", "timeout_s", "host", "port", "topic", "node", "tls"),
}
_VALUES = (
    *('"https://plant.example/x/"', '"http://[::1"', '"s3://bucket/../x"', '"file:///etc/passwd"', '"memory://x"'),
    *('"s3://"', '"http://u:p@h/"', '"http://127.0.0.1:1/x"', '"IRTWIN_TOKEN"', '"HOME"', '"€"', "nan", "1e999", "-1"),
    *("0x" + "f" * 300, "9" * 5000, "[" * 2000, "{}", "[]", "true", "'''", '"\\u0000"', '"../../x"', "1979-05-27"),
    *('"http://h:99999/"', '"http://ЖЖЖ.ru/"', '"http://h/%00"', '"' + "x" * 9000 + '"', '"\\u001b[31m"', "5", '"EUR"'),
)


def toml(name: str, rng: np.random.Generator) -> bytes:
    """Return such a file."""
    if rng.integers(8) == 0:
        return bytes(some(rng, [b"", b"\xff\xfe", b"[[[", b"\0", b"a.b.c" * 3000, b"x" * 200_000, b"[a]\n" * 9999]))
    lines = [f"{some(rng, _KEYS[name])} = {some(rng, _VALUES)}" for _ in range(rng.integers(1, 4))]
    if name == "alarms.toml":
        lines = [f"[[{some(rng, ['sparkplug', 'mqtt', 'x'])}]]", *lines] if rng.integers(4) else lines
    if rng.integers(10) == 0:
        lines.append(f"[{str(odd(rng))[:50]!r}]")
    return "\n".join(lines).encode("utf-8", "surrogatepass")
