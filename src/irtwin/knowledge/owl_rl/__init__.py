"""All of OWL 2 RL: the W3C's rules compiled to loops, and the datatypes that they need."""
