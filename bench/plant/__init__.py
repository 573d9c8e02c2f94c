"""A plant: a simulated industrial robot that stands in for a real one.

It shares no code with `irtwin`, so that what the twin recovers from its logs is a finding and not an echo.
"""
