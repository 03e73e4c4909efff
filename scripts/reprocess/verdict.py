# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Says in a few lines how a run over an archive ended; exit code 1 when a gate is not met."""
import sys
from pathlib import Path

from changes import load
from files import read_table


def main():
    results = Path(sys.argv[1])
    said = load(results / "changes.json")
    counts, changes = said["counts"], said["changes"]
    cost_s = sum(float(row["cpu_s"] or 0) for row in read_table(results / "summary.csv"))
    print(f"passed      {counts['pass']}")
    print(f"gates       {counts['gate']} with a result that misses a gate")
    print(f"no result   {counts['no_result']}, and {counts['crashed']} that crashed; see failed/")
    if "median_mm" in counts:
        print(f"error       {counts['median_mm']:.3f} mm in the median session, 90 % below {counts['p90_mm']:.3f} mm")
    print(f"cost        {cost_s:.1f} s of processor time in the programs, {cost_s / counts['sessions']:.2f} s a session")
    if changes:
        failed = len(changes["newly_failed"])
        print(f"changed     {changes['better']} better, {changes['worse']} worse, {changes['same']} the same,", end=" ")
        print(f"{failed} newly without a result: {changes.get('verdict', 'nothing to compare')}")
    print(f"overview    {results / 'overview.html'}")
    for gate in said["gates"]:
        if not gate["passed"]:
            value = "there is no such figure" if gate["value"] is None else f"is {gate['value']:.4g}"
            print(f"reprocess.sh: gate {gate['name']}: {value}, at most {gate['limit']} is asked for", file=sys.stderr)
    return 0 if said["passed"] else 1


if __name__ == "__main__":
    sys.exit(main())
