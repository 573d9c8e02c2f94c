"""Who waits for a worker: clients take turns, and none holds them all, so that none keeps others waiting."""

from __future__ import annotations

import asyncio
from collections import Counter, deque
from typing import Generic, TypeVar

from irtwin.serve.shares import Displaced, gives_way

T = TypeVar("T")


class Turns(Generic[T]):
    """Things that are lent, and who waits for one: client by client in turn, each client's requests in their order.

    `waiting` may wait. Where as many do, a client that has fewer of them than another takes the last place of that one.
    A client may hold `held` things at a time.
    """

    def __init__(self, waiting: int, held: int) -> None:
        self._most_waiting, self._most_held = waiting, held
        self._free: deque[T] = deque()
        self._held: Counter[str] = Counter()
        self._waiting: dict[str, deque[asyncio.Future[T]]] = {}  # by client, whose turn is next first

    def add(self, thing: T) -> None:
        """Have one thing more to lend."""
        self._free.append(thing)
        self._lend()

    async def take(self, client: str) -> T:
        """Return a free thing, wait until the client may have one. Raises Displaced where there is no room to wait."""
        if self._free and self._may_hold(client):
            self._held[client] += 1
            return self._free.popleft()
        self._make_room(client)
        place: asyncio.Future[T] = asyncio.get_running_loop().create_future()
        self._waiting.setdefault(client, deque()).append(place)
        try:
            return await place
        except BaseException:
            self._leave(client, place)
            if place.done() and not place.cancelled() and place.exception() is None:
                self.give(client, place.result())  # it came as who waited for it left
            raise

    def give(self, client: str, thing: T) -> None:
        """Take a thing back from a client, and lend it to who is next."""
        self.lose(client)
        self.add(thing)

    def lose(self, client: str) -> None:
        """Take it that what a client held is no more, nor on its way to be replaced."""
        self._held -= Counter([client])
        self._lend()

    def _may_hold(self, client: str) -> bool:
        return self._held[client] < self._most_held

    def _lend(self) -> None:
        while self._free and (client := next(filter(self._may_hold, self._waiting), None)) is not None:
            places = self._waiting.pop(client)
            place = places.popleft()
            if places:
                self._waiting[client] = places  # behind the others
            if not place.done():  # else who waited has just left
                self._held[client] += 1
                place.set_result(self._free.popleft())

    def _make_room(self, client: str) -> None:
        if sum(map(len, self._waiting.values())) < self._most_waiting:
            return
        most = gives_way({other: len(places) for other, places in self._waiting.items()}, client)
        self._waiting[most].pop().set_exception(Displaced())

    def _leave(self, client: str, place: asyncio.Future[T]) -> None:
        places = self._waiting.get(client, deque())
        if place in places:
            places.remove(place)
            if not places:
                del self._waiting[client]
