"""Arms that others modelled, moved by position servos that are told commands: what a simulator's model has wrong."""
