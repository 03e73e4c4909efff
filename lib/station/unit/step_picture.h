// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <future>
#include <optional>

#include "report/report_picture.h"

namespace vlp {

/// Plot for the unit's report, rendered asynchronously; std::nullopt if it could not be rendered.
using StepPlot = std::shared_future<std::optional<ReportPlot>>;

/// Makes and renders a drawing on its own thread, while the unit continues, because gnuplot would
/// delay the verdict. Destroying the last copy of the result waits for the thread.
StepPlot render_async(std::function<Drawing()> drawing);

}  // namespace vlp
