"""Where the samples of a run come from: one file a format."""
