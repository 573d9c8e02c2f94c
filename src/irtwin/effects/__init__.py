"""The effects that a twin may consist of."""
