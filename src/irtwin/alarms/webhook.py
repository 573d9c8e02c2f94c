"""Alarms to a web server: one POST each."""

from __future__ import annotations

from urllib.parse import urlsplit

import httpx

from irtwin.alarms.delivery import Undelivered

_TRY_AGAIN = (408, 425, 429)  # statuses below 500 that may pass
_GRACE = 1.0  # s beyond the timeout of a wait, so that a plain silence is told as such


class Webhook:
    """Posts each message as JSON, with a bearer token if one is given; redirects are not followed."""

    def __init__(self, url: str, token: str | None, timeout: float) -> None:
        """Take a URL that `settings` found sound; timeout: s for connecting, and for each wait on the server."""
        self.name = f"webhook at {urlsplit(url).netloc}"  # paths of webhooks are often secrets
        self._url, self._timeout = url, timeout
        self.patience = timeout + _GRACE
        headers = {"content-type": "application/json", "user-agent": "irtwin"}
        headers |= {} if token is None else {"authorization": f"Bearer {token}"}
        self._client = httpx.Client(timeout=timeout, follow_redirects=False, headers=headers)

    def send(self, line: bytes) -> None:
        """Post a message. Raises Undelivered unless the answer is 2xx."""
        try:
            with self._client.stream("POST", self._url, content=line) as answer:  # whose body nobody needs
                status = answer.status_code
        except httpx.TimeoutException:
            raise Undelivered(f"no answer within {self._timeout:g} s") from None
        except httpx.TransportError as error:
            raise Undelivered(str(error) or type(error).__name__) from None
        if 300 <= status < 400:
            raise Undelivered(
                f"it answered {status}, a redirect, which is not followed; set its url anew", lasting=True
            )
        if not 200 <= status < 300:
            raise Undelivered(f"it answered {status}", lasting=status < 500 and status not in _TRY_AGAIN)
