"""All commands in one group, and how a command ends."""

from __future__ import annotations

import errno
import os
import sys
import traceback
import warnings
from io import TextIOWrapper
from typing import Any

import click

from irtwin import __version__
from irtwin.cli import bring, docs, graph, motion, robot, service, twin, upkeep
from irtwin.cli.options import add_speech, say, speech
from irtwin.cli.sections import Sections
from irtwin.errors import GraphBehind, InputError

_LONGEST = 2000  # characters of an error
_NO_ROOM, _NO_RIGHT = "free some space and try again", "ask its owner for the right, or choose another place"
_OTHER_KIND = "a file is where a folder has to be, or a folder in place of a file; move it away"
_ASIDE = {  # what the system refuses, and what to do
    **dict.fromkeys((errno.ENOSPC, errno.EFBIG, errno.EDQUOT), _NO_ROOM),
    **dict.fromkeys((errno.EACCES, errno.EPERM, errno.EROFS), _NO_RIGHT),
    **dict.fromkeys((errno.EEXIST, errno.ENOTDIR, errno.EISDIR), _OTHER_KIND),
}
_python_warns = warnings.showwarning


def main() -> None:
    """Run the command line; a user's mistake is one line on standard error and exit status 2."""
    _check_system()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # a terminal without UTF-8 is no reason to stop
    warnings.showwarning = _warn
    try:
        cli.main(prog_name="irtwin", standalone_mode=False)
        sys.stdout.flush()
    except InputError as error:
        if speech.verbose:
            traceback.print_exc()
        say(f"irtwin: {error}"[:_LONGEST])
        sys.exit(2)
    except OSError as error:
        if error.errno not in (errno.EPIPE, *_ASIDE):
            raise
        if error.errno != errno.EPIPE:  # else who read the answer has left, and needs no word
            say(f"irtwin: {error.filename or 'the output'}: {error.strerror}; {_ASIDE[error.errno]}")
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # Python flushes once more at its end
        sys.exit(2)
    except click.ClickException as error:
        error.show()
        sys.exit(2)
    except (click.Abort, KeyboardInterrupt):
        click.echo("irtwin: stopped", err=True)
        sys.exit(130)


def _warn(message: Warning | str, category: type[Warning], *where: Any, **how: Any) -> None:
    """Say in one line what people are to know, and any other warning as Python does."""
    if issubclass(category, GraphBehind):
        say(f"irtwin: {message}")
    else:
        _python_warns(message, category, *where, **how)


def _check_system() -> None:
    if os.name != "posix":  # said before anything that locks files is imported
        say("irtwin: this system is not supported: irtwin runs on Linux; on Windows, install it in WSL")
        sys.exit(2)


@click.group(
    cls=Sections,
    sections={
        "Bring a log": (bring.import_, twin.check, robot.robot),
        "Build the twin": (twin.demo, twin.run, twin.improve),
        "Find the gap": (twin.diagnose,),
        "Plan and save": (motion.plan, motion.predict, motion.optimise),
        "Ask": (graph.query, graph.explain, graph.export),
        "Watch": (service.serve, service.live, service.alarms),
        "Keep": (upkeep.workspace,),
        "Learn": (docs.docs,),
    },
    renamed={
        "adopt": "improve",
        "case-study": "demo --case-study",
        "excite": "robot excite",
        **{name: f"workspace {name}" for name in upkeep.workspace.commands},
    },
    replaced={
        "init": "import --robot ROBOT --out FOLDER",
        "fleet": "run FOLDER --out RESULTS`, or `irtwin diagnose FOLDER --out RESULTS",
        "slow": "optimise ROBOT RUN --cycle SECONDS",
        "graph": "workspace reason` and `map`, and `irtwin docs --ontology FILE",
    },
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.version_option(__version__, prog_name="irtwin")
def cli() -> None:
    """Build a digital twin of an industrial robot's energy and keep it in a knowledge graph.

    Start with `irtwin demo`. It builds a twin, a graph and a report from simulated logs of a KUKA KR6 R700. `irtwin
    FILE`, of a log, a robot, a model or a folder, says what it is and what can be done with it.
    """


add_speech(cli)
