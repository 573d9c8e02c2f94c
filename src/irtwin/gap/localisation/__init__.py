"""Where the gap lies: joints, regimes, and the variable that a residual follows."""
