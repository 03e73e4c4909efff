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

/// Draws the errors of the fixes on the floor plan. Throws InputError when image names do not
/// match.
Drawing draw_floor_plan(const EvaluationInput& input, const LampMap& lamps);

/// Errors on the floor and their distribution; with a commanded line the drive along it instead of
/// the floor. Throws InputError, see svg_of(). Precondition: there is a fix.
std::vector<ReportPicture> evaluation_pictures(const EvaluationInput& input,
                                               const Evaluation& evaluation, const LampMap& lamps);

/// What the stated uncertainty of fixes comes from, horizontally: of each its noise, and the part
/// of calibration and map, divided as a level camera's fix from all lamps in view there, without
/// those that were left out, would be (UnitErrors). Fixes whose lean was estimated, of which that
/// is not true, are left out. Precondition, which the fixes do not tell: they are of the camera,
/// not of a robot's centre. Nothing when no fix states such a part. Throws InputError, see
/// svg_of().
std::optional<ReportPicture> budget_picture(const std::vector<FixRow>& fixes, const LampMap& lamps,
                                            const Calibration& calibration);

/// A drive along a commanded line. Precondition: `fit` is that of the fixes.
ReportPicture drive_picture(const std::string& title, const std::vector<FixRow>& fixes,
                            const CommandedLine& commanded_m, const LineFit& fit);

}  // namespace vlp
