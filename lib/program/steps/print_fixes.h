// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "evaluation/fix_summary.h"

namespace vlp {

/// How many frames have a fix, why others have none, and how good the fixes are, on stdout.
void print_fixes(const FixSummary& summary);

}  // namespace vlp
