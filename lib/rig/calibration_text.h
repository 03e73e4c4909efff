// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calibration.h"

// Not installed, and not exported by the shared library.
#pragma GCC visibility push(hidden)
namespace vlp {

/// Returns the text that write_calibration() writes.
std::string format_calibration_yaml(const Calibration& calibration);

}  // namespace vlp
#pragma GCC visibility pop
