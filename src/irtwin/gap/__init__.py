"""The gap between a twin and what is measured: where it lies, what causes it, how far it shrinks."""
