"""Finding the numbers: base parameters, estimators, exciting motion."""
