// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "evaluation/evaluation.h"
#include "report/plots/gnuplot.h"
#include "report/report_picture.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Plots the errors of the fixes on the floor plan.
/// @throws InputError if image names do not match
Drawing draw_floor_plan(const EvaluationInput& input, const LampMap& lamps);

/// Returns the plots of an evaluation, not rendered yet: the errors on the floor plan, and their
/// distribution. With a commanded line, the drive along it takes the place of the floor plan.
/// @pre there is at least one fix
/// @throws InputError if image names do not match
std::vector<ReportPlot> make_error_plots(const EvaluationInput& input, const Evaluation& evaluation,
                                         const LampMap& lamps);

/// Returns a plot of the contributions to the reported horizontal variance of each fix.
///
/// The noise is that of the fix. The common part of calibration and map is divided in proportion to
/// an error budget (UnitErrors). It is that of a level camera with all lamps in view there, without
/// rejected ones. Fixes with an estimated roll and pitch are omitted, as this does not hold for
/// them.
///
/// Returns std::nullopt if no fix reports such a common part.
/// @pre the fixes are positions of the camera, not of a robot's center; this cannot be checked here
std::optional<ReportPlot> make_budget_plot(const std::vector<FixRow>& fixes, const LampMap& lamps,
                                           const Calibration& calibration);

/// Returns a plot of a drive along a commanded line.
/// @pre `fit` is the line fit of `fixes`
ReportPlot make_drive_plot(const std::string& title, const std::vector<FixRow>& fixes,
                           const CommandedLine& commanded_m, const LineFit& fit);

}  // namespace vlp
