"""A plant: a simulated industrial robot that stands in for a real one, one run at a time.

It imports nothing else of `irtwin`, so that what the twin recovers from its logs is a finding and not an echo.
"""
