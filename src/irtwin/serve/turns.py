"""Who waits for a worker: clients take turns, so that one with many queries does not keep others waiting."""

from __future__ import annotations

import asyncio
from collections import deque
from typing import Generic, TypeVar

T = TypeVar("T")


class Displaced(Exception):
    """A place in the queue was given to another client, which had fewer."""


class Turns(Generic[T]):
    """Things that are lent, and who waits for one: client by client in turn, each client's requests in their order.

    `most` may wait. Where as many do, a client that has fewer of them than another takes the last place of that one.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._free: deque[T] = deque()
        self._waiting: dict[str, deque[asyncio.Future[T]]] = {}  # by client, whose turn is next first

    async def take(self, client: str) -> T:
        """Return a free thing, wait for one if there is none. Raises Displaced where there is no room to wait."""
        if self._free:
            return self._free.popleft()
        self._make_room(client)
        place: asyncio.Future[T] = asyncio.get_running_loop().create_future()
        self._waiting.setdefault(client, deque()).append(place)
        try:
            return await place
        except BaseException:
            self._leave(client, place)
            if place.done() and not place.cancelled() and place.exception() is None:
                self.give(place.result())  # it came as who waited for it left
            raise

    def give(self, thing: T) -> None:
        """Lend a thing to who is next, or keep it for who comes."""
        while self._waiting:
            client = next(iter(self._waiting))
            places = self._waiting.pop(client)
            place = places.popleft()
            if places:
                self._waiting[client] = places  # behind the others
            if not place.done():  # else who waited has just left
                return place.set_result(thing)
        self._free.append(thing)

    def _make_room(self, client: str) -> None:
        if sum(map(len, self._waiting.values())) < self._most:
            return
        longest = max(self._waiting.values(), key=len, default=deque())
        if len(longest) <= len(self._waiting.get(client, ())) + 1:
            raise Displaced
        longest.pop().set_exception(Displaced())

    def _leave(self, client: str, place: asyncio.Future[T]) -> None:
        places = self._waiting.get(client, deque())
        if place in places:
            places.remove(place)
            if not places:
                del self._waiting[client]
