"""What does not repeat: how two runs of one motion differ, beyond the noise of the sensors."""
