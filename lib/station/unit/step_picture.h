// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <future>
#include <optional>

#include "report/report_picture.h"

namespace vlp {

/// A picture for the unit's report that is being drawn; nothing when it could not be.
using StepPicture = std::shared_future<std::optional<ReportPicture>>;

/// Makes a drawing and draws it on a thread of its own, while the unit goes on: gnuplot takes
/// longer than an operator should wait for a verdict. The last copy waits for the end.
StepPicture draw_aside(std::function<Drawing()> drawing);

}  // namespace vlp
