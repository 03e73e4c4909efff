// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calibration.h"

// Not installed, and not exported by the shared library.
#pragma GCC visibility push(hidden)
namespace vlp {

/// Formats a calibration as YAML text, format `vlp-calibration/1`: the content of the file of
/// write_calibration().
std::string format_calibration(const Calibration& calibration);

}  // namespace vlp
#pragma GCC visibility pop
