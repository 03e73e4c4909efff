// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "report/plots/gnuplot.h"

namespace vlp {

/// What part of the report a picture belongs to.
enum class ReportPart { camera, rotation, dispersion, floor, distribution, tracks, other };

struct ReportPicture {
  ReportPart part;
  /// An SVG or a PNG, whole.
  std::string image;
  /// What it shows, how to read it; for those who see it and for those who do not.
  std::string caption, alt;
  /// Drawing::table.
  std::vector<std::vector<std::string>> table = {};
};

/// A picture that a program drew. It is recognised by its title; one that is not (a PNG has none)
/// belongs to `other` and has its name for a caption. Throws InputError when the file cannot be
/// read, is longer than 16 MiB, or is neither SVG nor PNG.
ReportPicture read_report_picture(const std::filesystem::path& file);

/// The same of a picture that is drawn here. Throws InputError, see svg_of().
ReportPicture report_picture(const Drawing& drawing);

}  // namespace vlp
