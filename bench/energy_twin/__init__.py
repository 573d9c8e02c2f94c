"""How right the energy of a twin is that nobody chose effects for."""
