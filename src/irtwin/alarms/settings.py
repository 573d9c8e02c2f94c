"""Who is told of alarms: `alarms.toml` in a workspace. Secrets stand in the environment, the file names the variables.

Each receiver is asked for by a name that says where messages go, and which variables with them. Only variables that
are called IRTWIN_... are read, so that no file gets at others' secrets.

[[mqtt]]
host = "broker.plant"
port = 1883                             # optional; 8883 with tls
topic = "plant/robots/alarms"
user = "irtwin"                         # optional, as are the next
password_env = "IRTWIN_MQTT_PASSWORD"
tls = true
timeout_s = 5

[[sparkplug]]                           # not alarms, but the robots, by Sparkplug B; with the optional keys of mqtt
host = "broker.plant"
node = "plant/irtwin"                   # GROUP/NODE
"""

from __future__ import annotations

import os
import re
from collections.abc import Container, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from irtwin.errors import InputError
from irtwin.toml_file import TomlTable, read_toml, shown

if TYPE_CHECKING:
    from irtwin.alarms.mqtt import Broker

NAME = "alarms.toml"
_VARIABLE = re.compile(r"IRTWIN_[A-Z0-9_]{1,100}")
_OWN = ("IRTWIN_DATABASE", "IRTWIN_GRAPH", "IRTWIN_GRAPH_TOKEN", "IRTWIN_TOKEN")  # that give access to irtwin itself
_TIMEOUT = 5.0  # s
_SHORTEST = 0.1  # s
_PLACES = {"mqtt": "topic", "sparkplug": "node"}  # the key that says what a broker is told, by kind
_KEYS = {kind: ("host", "port", place, "user", "password_env", "tls", "timeout_s") for kind, place in _PLACES.items()}


def read_settings(
    file: Path, environment: Mapping[str, str] = os.environ, may: Container[str] | None = None
) -> tuple[list[Broker], list[Broker]]:
    """Return the brokers that are told of alarms by a file, and those that are told of robots by Sparkplug B.

    The latter have GROUP/NODE as their topic. `may`: whom the file may tell, by name; all if None. Raises InputError,
    naming file, table and key, on all that is wrong.
    """
    brokers: dict[str, list[Broker]] = {kind: [] for kind in _PLACES}
    try:
        for kind, table in _tables(file):
            if may is None or _asked(kind, table) in may:
                brokers[kind].append(_broker(kind, table, environment))
    except ModuleNotFoundError as error:
        raise InputError(
            f"alarms cannot be sent without the package {error.name}; pip install 'irtwin[alarms]'"
        ) from None
    return brokers["mqtt"], brokers["sparkplug"]


def asks(file: Path) -> list[str]:
    """Return what a file asks for, by name. Raises InputError as `read_settings`."""
    return [_asked(kind, table) for kind, table in _tables(file)]


def _tables(file: Path) -> list[tuple[str, TomlTable]]:
    """Return the table of each receiver of a file, with its kind."""
    document = read_toml(file)
    TomlTable(file, "", document).check_keys(tuple(_KEYS))
    asked = []
    for kind, keys in _KEYS.items():
        tables = document.get(kind, [])
        if not (isinstance(tables, list) and all(isinstance(entry, dict) for entry in tables)):
            raise InputError(f"{file}: {kind} should be tables; write [[{kind}]] above its keys")
        for number, values in enumerate(tables, start=1):
            table = TomlTable(file, f"{kind} {number}:", values)
            table.check_keys(keys)
            asked.append((kind, table))
    if not asked:
        raise InputError(
            f"{file}: names nobody; write [[mqtt]] with host and topic, or [[sparkplug]] with host and node"
        )
    return asked


def _asked(kind: str, table: TomlTable) -> str:
    """Return the name by which a receiver is asked for: where its messages go, and which variable with them."""
    port = table.values.get("port", 8883 if table.values.get("tls") is True else 1883)
    variable, place = table.text("password_env"), _PLACES[kind]
    beside = f", with {variable}" if variable else ""
    return f"{NAME}: {kind} at {table.text('host')}:{port}, {place} {table.text(place)}{beside}"


def _broker(kind: str, table: TomlTable, environment: Mapping[str, str]) -> Broker:
    host, topic = (table.needed(key) for key in ("host", _PLACES[kind]))
    if kind == "sparkplug" and [bool(part) for part in topic.split("/")] != [True, True]:
        raise table.fault("node", f"should be GROUP/NODE, not {shown(topic)}")
    if any(sign in topic for sign in "+#\0") or len(topic.encode()) > 65535:
        raise table.fault(_PLACES[kind], "should be that of one place, without + and #")
    tls = table.values.get("tls", False)
    if not isinstance(tls, bool):
        raise table.fault("tls", f"should be true or false, not {shown(tls)}")
    port = table.values.get("port", 8883 if tls else 1883)
    if isinstance(port, bool) or not isinstance(port, int) or not 0 < port < 65536:
        raise table.fault("port", f"should be a whole number of 1 to 65535, not {shown(port)}")
    user, password = table.text("user"), _secret(table, "password_env", environment)
    if password is not None and user is None:
        raise table.fault("password_env", "goes with user")
    timeout = table.number("timeout_s", least=_SHORTEST) or _TIMEOUT
    from irtwin.alarms.mqtt import Broker  # an extra

    return Broker(host, port, topic, user, password, tls, timeout)


def _secret(table: TomlTable, key: str, environment: Mapping[str, str]) -> str | None:
    """Return the value of the variable that a key names. Raises InputError where it is not set."""
    name = table.text(key)
    if name is None:
        return None
    if not _VARIABLE.fullmatch(name) or name in _OWN:
        raise table.fault(
            f"{key}:",
            f"{shown(name)[1:-1]} is not read; give the secret in a variable of its own whose name begins with "
            "IRTWIN_, as IRTWIN_MQTT_PASSWORD",
        )
    value = environment.get(name, "").strip()
    if not (value and value.isascii() and value.isprintable()):
        raise table.fault(f"{key}:", f"the environment has no usable {shown(name)[1:-1]}")
    return value
