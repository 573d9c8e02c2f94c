"""`python -m irtwin` is the command line."""

from irtwin.cli import main

main()
