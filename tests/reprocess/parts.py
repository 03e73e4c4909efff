# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Where the tests of scripts/reprocess find its parts; they are skipped where what these need is missing."""
import sys
from pathlib import Path

sys.dont_write_bytecode = True
SOURCE = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(SOURCE / "scripts/reprocess"), str(SOURCE / "tests/support")]
try:
    import yaml  # noqa: F401
except ImportError:
    print("yaml is missing: scripts/setup.sh --batch")
    sys.exit(77)
