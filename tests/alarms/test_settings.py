"""`alarms.toml`: who is told, and what is said of each mistake."""

from __future__ import annotations

from pathlib import Path

import pytest

from irtwin.alarms.settings import asks, read_settings
from irtwin.errors import InputError

ENVIRONMENT = {
    "IRTWIN_HOOK": "https://example.com/secret",
    "IRTWIN_HOOK_TOKEN": "t0ken",
    "IRTWIN_PASSWORD": "pa55",
    "IRTWIN_EMPTY": " ",
}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "alarms.toml"


def test_webhooks_and_brokers_are_read_and_their_names_hold_no_secret(file: Path) -> None:
    file.write_text(
        '[[webhook]]\nurl_env = "IRTWIN_HOOK"\ntoken_env = "IRTWIN_HOOK_TOKEN"\ntimeout_s = 2\n'
        '[[webhook]]\nurl = "http://127.0.0.1:8000/robots"\n'
        '[[mqtt]]\nhost = "broker"\ntopic = "plant/alarms"\nuser = "me"\npassword_env = "IRTWIN_PASSWORD"\ntls = true\n'
    )
    receivers, _ = read_settings(file, ENVIRONMENT)
    names = ["webhook at example.com", "webhook at 127.0.0.1:8000", "MQTT broker at broker:8883"]
    assert [receiver.name for receiver in receivers] == names
    assert not any(secret in repr(receivers) for secret in ("pa55", "t0ken", "secret"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "names nobody; write"),
        ('[[webhok]]\nurl = "http://a"', "webhok is not known; did you mean webhook?"),
        ('[webhook]\nurl = "http://a"', r"webhook should be tables; write \[\[webhook\]\]"),
        ('[[webhook]]\nadress = "http://a"', "webhook 1: adress is not known; it may have url, "),
        ("[[webhook]]\ntimeout_s = 3", "webhook 1: needs url, or url_env, one of them"),
        ('[[webhook]]\nurl = "http://a"\nurl_env = "IRTWIN_HOOK"', "needs url, or url_env, one of them"),
        ('[[webhook]]\nurl = "ftp://a/b"', "its URL should be http:// or https://"),
        ('[[webhook]]\nurl = "https://me:pass@a/b"', "without user or password; a token goes by token_env"),
        ('[[webhook]]\nurl = "http://a:b/"', "its URL should be"),
        ('[[webhook]]\nurl_env = "IRTWIN_NONE"', "url_env: the environment has no usable IRTWIN_NONE"),
        (
            '[[webhook]]\nurl = "http://a"\ntoken_env = "IRTWIN_EMPTY"',
            "the environment has no usable IRTWIN_EMPTY",
        ),
        ('[[webhook]]\nurl = "http://a"\ntimeout_s = 0', "timeout_s should be a number of at least 0.1, not 0"),
        ('[[mqtt]]\nhost = "a"', "mqtt 1: topic is missing"),
        ('[[sparkplug]]\nhost = "a"', "sparkplug 1: node is missing"),
        ('[[sparkplug]]\nhost = "a"\nnode = "b"', "sparkplug 1: node should be GROUP/NODE, not 'b'"),
        ('[[sparkplug]]\nhost = "a"\nnode = "b/+"', "sparkplug 1: node should be that of one place"),
        ('[[mqtt]]\nhost = "a"\ntopic = "plant/#"', "topic should be that of one place"),
        ('[[mqtt]]\nhost = "a"\ntopic = "b"\nport = "1883"', "port should be a whole number of 1 to 65535, not '1883'"),
        ('[[mqtt]]\nhost = "a"\ntopic = "b"\ntls = 1', "tls should be true or false, not 1"),
        ('[[mqtt]]\nhost = "a"\ntopic = "b"\npassword_env = "IRTWIN_PASSWORD"', "password_env goes with user"),
        ("[[mqtt]", "not valid TOML"),
        (
            '[[webhook]]\nurl = "http://a"\ntoken_env = "AWS_SECRET_ACCESS_KEY"',
            "AWS_SECRET_ACCESS_KEY is not read",
        ),
        ('[[webhook]]\nurl = "http://a"\ntoken_env = "IRTWIN_TOKEN"', "IRTWIN_TOKEN is not read; give the secret in"),
        ('[[webhook]]\nurl_env = "HOME"', "url_env: HOME is not read"),
        ('[[mqtt]]\nhost = "a"\ntopic = "b"\nuser = "c"\npassword_env = "PATH"', "password_env: PATH is not read"),
    ],
)
def test_mistakes_are_named(file: Path, text: str, message: str) -> None:
    file.write_text(text)
    with pytest.raises(InputError, match=message) as refused:
        read_settings(file, ENVIRONMENT)
    assert str(refused.value).startswith(f"{file}: ")
    assert "me:pass" not in str(refused.value)


def test_only_receivers_that_the_user_trusts_are_told(file: Path) -> None:
    file.write_text(
        '[[webhook]]\nurl = "https://mine.example/a"\ntoken_env = "IRTWIN_HOOK_TOKEN"\n'
        '[[webhook]]\nurl = "https://theirs.example/a"\ntoken_env = "IRTWIN_HOOK_TOKEN"\n'
        '[[mqtt]]\nhost = "broker"\ntopic = "t"\n'
    )
    mine, theirs, broker = asks(file)
    assert mine == "alarms.toml: webhook at mine.example, with IRTWIN_HOOK_TOKEN"
    assert broker == "alarms.toml: mqtt at broker:1883, topic t"
    assert [it.name for it in read_settings(file, ENVIRONMENT, {mine})[0]] == ["webhook at mine.example"]
    assert read_settings(file, {}, {theirs.replace("theirs", "other")}) == ([], [])  # nor is a variable looked up
