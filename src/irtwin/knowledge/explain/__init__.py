"""From a triple back to what it was made of."""
