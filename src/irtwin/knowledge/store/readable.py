"""Whether a SPARQL text can be read: the parser calls itself at each level, and one too deep for the stack ends it all.

So a text that is long enough for that is read by a process of its own first; which of SPARQL's many ways to nest it
uses, that process tells by how it ends.
"""

from __future__ import annotations

import json
import subprocess
import sys

from irtwin.knowledge.vocabulary import PREFIXES

NOT_READABLE = "is nested too deeply, or too long, to be read"
_SHORT = 1500  # characters: 2,000 open braces are read, 3,000 are not
_SECONDS = 10  # of the processor
_STACK = 4_000_000  # bytes, half of what is usual: what is read there is read wherever less is left
_READ = f"""
import json, resource, sys
from pyoxigraph import Store
resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
resource.setrlimit(resource.RLIMIT_CPU, ({_SECONDS}, {_SECONDS}))
resource.setrlimit(resource.RLIMIT_STACK, ({_STACK}, {_STACK}))
text, base, prefixes = json.load(sys.stdin)
Store().query(text, base_iri=base, prefixes=prefixes)
"""


def is_readable(text: str, base: str | None) -> bool:
    """Whether reading a query comes to an end, be it an error."""
    if len(text) <= _SHORT:
        return True
    key = json.dumps([text, base, PREFIXES])
    done = subprocess.run([sys.executable, "-c", _READ], input=key, text=True, capture_output=True, check=False)
    return done.returncode >= 0
