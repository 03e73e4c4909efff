# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Import path of scripts/reprocess for its tests. Exits with 77, which skips a test, if a required module is
missing."""
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
