"""What clients share: who a client is, and whose place goes to another where all are taken."""

from __future__ import annotations

import ipaddress
from collections.abc import Mapping

from starlette.requests import Request


class Displaced(Exception):
    """There is no place for a client: it has as many as any other, or another that has fewer took it."""


def client(request: Request) -> str:
    """Return the client that asks, by its address; clients of one machine, or behind one proxy, are one."""
    return client_of(request.client.host if request.client is not None else "")


def client_of(address: str) -> str:
    """Return the client that an address is of: an IPv6 network of 64 bits is one, as a machine may use all of it."""
    try:
        client = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return address  # what a proxy says of its client
    if isinstance(client, ipaddress.IPv4Address):
        return str(client)
    return str(client.ipv4_mapped or ipaddress.ip_network((client, 64), strict=False))


def gives_way(taken: Mapping[str, int], client: str) -> str:
    """Return the client that gives up a place to another where all are taken: the one that has most of them.

    taken: places by client. Raises Displaced where `client` would have as many as that one had, so each has its share.
    """
    most = max(taken, key=lambda other: taken[other], default=client)
    if taken.get(most, 0) <= taken.get(client, 0) + 1:
        raise Displaced
    return most
