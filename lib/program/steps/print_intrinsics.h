// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/intrinsics/calibration_report.h"

namespace vlp {

/// Prints the solved lens and its uncertainty to stdout.
void print_summary(const IntrinsicsSolution& solution, const CalibrationReport& report,
                   const ViewCoverage& coverage, const HeldOut& held_out);

}  // namespace vlp
