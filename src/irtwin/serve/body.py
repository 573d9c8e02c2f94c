"""What a request brings: as much as is allowed, in as long as is allowed."""

from __future__ import annotations

import asyncio

from starlette.requests import Request

from irtwin.serve.protocol import Refusal


async def read_body(request: Request, most: int, seconds: float) -> bytes:
    """Read a request's body of at most so many bytes, within so many seconds. Raises Refusal."""
    body = bytearray()
    try:
        async with asyncio.timeout(seconds):
            async for piece in request.stream():
                body += piece
                if len(body) > most:
                    raise Refusal(413, f"a request has at most {most:,} bytes")
    except TimeoutError:
        raise Refusal(408, "the request did not come in time") from None
    return bytes(body)
