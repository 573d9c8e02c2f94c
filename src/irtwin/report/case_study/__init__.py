"""The page of the seed paper's case study."""
