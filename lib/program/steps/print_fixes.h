// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "evaluation/fix_summary.h"

namespace vlp {

/// Prints the number of frames with a fix, the reasons why others have none, and the quality of the
/// fixes to stdout.
void print_fixes(const FixSummary& summary);

}  // namespace vlp
