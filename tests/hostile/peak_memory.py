# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""peak_memory.py FILE COMMAND...: runs a command, and writes the largest resident size of its
processes to FILE, in MiB. The size of a child of a large process would include that of the parent.
"""
import resource
import subprocess
import sys

code = subprocess.call(sys.argv[2:])
with open(sys.argv[1], "w", encoding="ascii") as file:
    file.write(str(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024))
sys.exit(code if code >= 0 else 128 - code)
