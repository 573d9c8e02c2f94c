"""The CO2 that each run stands for: an extension of irtwin."""
