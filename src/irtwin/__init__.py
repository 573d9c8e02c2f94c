"""A digital twin of an industrial robot's energy, held in a knowledge graph."""

__version__ = "0.1.0"
