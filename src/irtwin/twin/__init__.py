"""A robot, its effects and the numbers that fit them to what was measured."""
