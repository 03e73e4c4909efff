// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <future>
#include <optional>

#include "report/report_picture.h"

namespace vlp {

/// Plot for the unit's report, rendered asynchronously; std::nullopt if it could not be rendered.
using StepPicture = std::shared_future<std::optional<ReportPicture>>;

/// Makes and renders a drawing on its own thread, while the unit continues, because gnuplot would
/// delay the verdict. Destroying the last copy of the result waits for the thread.
StepPicture draw_aside(std::function<Drawing()> drawing);

}  // namespace vlp
