// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calibration.h"

// Not installed: nothing for the shared library to show.
#pragma GCC visibility push(hidden)
namespace vlp {

/// The text that write_calibration() writes.
std::string calibration_text(const Calibration& calibration);

}  // namespace vlp
#pragma GCC visibility pop
