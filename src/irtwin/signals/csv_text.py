"""A motion as the text of a CSV file, in the columns of the log format."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

import numpy as np

from irtwin.signals.channels import Signals, columns_of


def csv_text(motion: Signals, joint_names: Sequence[str]) -> str:
    """Return columns time, q_J, dq_J, ddq_J (s, rad, rad/s, rad/s^2) of each joint J, a row a sample, to ten digits."""
    columns = columns_of(motion, joint_names)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([f"{value:.10g}" for value in row] for row in np.column_stack(list(columns.values())))
    return text.getvalue()
