// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "readout_option.h"

#include <spdlog/spdlog.h>

#include <map>
#include <string>

#include "detection/image_file.h"
#include "detection/readout.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

/// Nothing for what is no image: it is reported when the lights are looked for.
cv::Mat image_or_nothing(const std::filesystem::path& file) {
  try {
    return read_image(file);
  } catch (const InputError&) {
    return {};
  }
}

}  // namespace

void add_readout_option(CLI::App& app, std::optional<Readout>& readout) {
  static const std::map<std::string, Readout> names{{"rows", Readout::rows},
                                                    {"columns", Readout::columns}};
  app.add_option_function<std::string>(
         "--readout", [&readout](const std::string& name) { readout = names.at(name); },
         "Along what the shutter reads and stripes lie (default: as the calibration says, or else "
         "as the images show)")
      ->check(CLI::IsMember({"rows", "columns"}))
      ->option_text("rows|columns");
}

Readout readout_for(const std::optional<Readout>& option, const std::optional<Readout>& calibrated,
                    std::span<const std::filesystem::path> images) {
  if (option) return *option;
  if (calibrated) return *calibrated;
  const auto found =
      find_readout(images.size(), [&](std::size_t i) { return image_or_nothing(images[i]); });
  if (!found) {
    spdlog::warn(
        "the read-out is not stated and the images do not show it: rows are taken; --readout "
        "tells it");
    return Readout::rows;
  }
  spdlog::info("the read-out is not stated: the images show stripes along {}",
               *found == Readout::rows ? "rows" : "columns");
  return *found;
}

}  // namespace vlp
