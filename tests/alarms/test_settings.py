"""`alarms.toml`: who is told, and what is said of each mistake."""

from __future__ import annotations

from pathlib import Path

import pytest

from irtwin.alarms.settings import asks, read_settings
from irtwin.errors import InputError

ENVIRONMENT = {"IRTWIN_PASSWORD": "pa55", "IRTWIN_EMPTY": " "}
MQTT = '[[mqtt]]\nhost = "a"\ntopic = "b"\n'


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "alarms.toml"


def test_brokers_are_read_and_their_names_hold_no_secret(file: Path) -> None:
    file.write_text(
        '[[mqtt]]\nhost = "broker"\ntopic = "plant/alarms"\nuser = "me"\npassword_env = "IRTWIN_PASSWORD"\ntls = true\n'
        '[[sparkplug]]\nhost = "other"\nnode = "plant/irtwin"\ntimeout_s = 2\n'
    )
    of_alarms, of_robots = read_settings(file, ENVIRONMENT)
    assert [broker.name for broker in of_alarms] == ["MQTT broker at broker:8883"]
    assert [(broker.port, broker.topic, broker.timeout) for broker in of_robots] == [(1883, "plant/irtwin", 2.0)]
    assert "pa55" not in repr(of_alarms)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "names nobody; write"),
        ('[[mqt]]\nhost = "a"', "mqt is not known; did you mean mqtt?"),
        ('[[webhook]]\nurl = "http://a"', "webhook is not known; it may have mqtt, sparkplug"),
        ('[mqtt]\nhost = "a"', r"mqtt should be tables; write \[\[mqtt\]\]"),
        ('[[mqtt]]\nadress = "a"', "mqtt 1: adress is not known; it may have host, "),
        (f"{MQTT}timeout_s = 0", "timeout_s should be a number of at least 0.1, not 0"),
        ('[[mqtt]]\nhost = "a"', "mqtt 1: topic is missing"),
        ('[[sparkplug]]\nhost = "a"', "sparkplug 1: node is missing"),
        ('[[sparkplug]]\nhost = "a"\nnode = "b"', "sparkplug 1: node should be GROUP/NODE, not 'b'"),
        ('[[sparkplug]]\nhost = "a"\nnode = "b/+"', "sparkplug 1: node should be that of one place"),
        ('[[mqtt]]\nhost = "a"\ntopic = "plant/#"', "topic should be that of one place"),
        ('[[mqtt]]\nhost = "a"\ntopic = "b"\nport = "1883"', "port should be a whole number of 1 to 65535, not '1883'"),
        ('[[mqtt]]\nhost = "a"\ntopic = "b"\ntls = 1', "tls should be true or false, not 1"),
        ('[[mqtt]]\nhost = "a"\ntopic = "b"\npassword_env = "IRTWIN_PASSWORD"', "password_env goes with user"),
        ("[[mqtt]", "not valid TOML"),
        (f'{MQTT}user = "c"\npassword_env = "IRTWIN_NONE"', "the environment has no usable IRTWIN_NONE"),
        (f'{MQTT}user = "c"\npassword_env = "IRTWIN_EMPTY"', "the environment has no usable IRTWIN_EMPTY"),
        (f'{MQTT}user = "c"\npassword_env = "IRTWIN_TOKEN"', "IRTWIN_TOKEN is not read; give the secret in"),
        ('[[mqtt]]\nhost = "a"\ntopic = "b"\nuser = "c"\npassword_env = "PATH"', "password_env: PATH is not read"),
    ],
)
def test_mistakes_are_named(file: Path, text: str, message: str) -> None:
    file.write_text(text)
    with pytest.raises(InputError, match=message) as refused:
        read_settings(file, ENVIRONMENT)
    assert str(refused.value).startswith(f"{file}: ")


def test_only_receivers_that_the_user_trusts_are_told(file: Path) -> None:
    secret = 'topic = "t"\nuser = "me"\npassword_env = "IRTWIN_PASSWORD"\n'
    file.write_text(f'[[mqtt]]\nhost = "mine"\n{secret}[[mqtt]]\nhost = "theirs"\n{secret}')
    mine, theirs = asks(file)
    assert mine == "alarms.toml: mqtt at mine:1883, topic t, with IRTWIN_PASSWORD"
    assert [it.name for it in read_settings(file, ENVIRONMENT, {mine})[0]] == ["MQTT broker at mine:1883"]
    assert read_settings(file, {}, {theirs.replace("theirs", "other")}) == ([], [])  # nor is a variable looked up
