"""`python -m plant CAMPAIGN FOLDER`: simulate a campaign's runs and write its data set."""

from __future__ import annotations

import argparse
from pathlib import Path

from plant.campaign import CAMPAIGNS, carry_out, read_campaign
from plant.dataset import describe
from plant.drawings import read_drawings


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m plant", description=__doc__)
    parser.add_argument("campaign", choices=sorted(file.stem for file in CAMPAIGNS.glob("*.toml")))
    parser.add_argument("folder", type=Path)
    arguments = parser.parse_args()
    campaign = read_campaign(arguments.campaign)
    drawings = read_drawings(campaign.robot)
    for run, _, recording in carry_out(campaign):
        recording.write(arguments.folder / "runs" / f"{run.name}.parquet", drawings.joints)
        book = recording.book
        print(
            f"{run.name:20} {recording.time[-1]:6.1f} s  {book.grid:8.0f} J  "
            f"{recording.power.min():5.0f} to {recording.power.max():5.0f} W  "
            f"{recording.temperature[-1].min():4.1f} to {recording.temperature[-1].max():4.1f} degC",
            flush=True,
        )
    (arguments.folder / "dataset.toml").write_text(describe(campaign, drawings), encoding="utf-8")


if __name__ == "__main__":
    main()
