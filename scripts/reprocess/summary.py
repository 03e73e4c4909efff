# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Joins the rows of the shards, in RESULTS, to summary.csv."""
from pathlib import Path

from files import read_table, table, write_whole
from outcome import COLUMNS


def main():
    shards = sorted(file.stem for file in Path(".state/shards").glob("*.list"))
    rows = [row for shard in shards for row in read_table(f".state/rows/{shard}.csv")]
    write_whole("summary.csv", table(COLUMNS, rows))


if __name__ == "__main__":
    main()
