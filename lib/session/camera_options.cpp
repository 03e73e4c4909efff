// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/camera_options.h"

#include <fmt/core.h>

namespace vlp {

std::string format_camera_options(const SessionOptions& options) {
  const FrontendOptions defaults;
  const FrontendOptions& frontend = options.frontend;
  std::string text = "--camera-id " + options.camera_id;
  if (frontend.row_time_s) text += fmt::format(" --row-time-s {}", *frontend.row_time_s);
  if (frontend.readout)
    text += *frontend.readout == Readout::rows ? " --readout rows" : " --readout columns";
  if (frontend.max_blur_fraction != defaults.max_blur_fraction)
    text += fmt::format(" --max-blur-fraction {}", frontend.max_blur_fraction);
  if (frontend.max_white_fraction != defaults.max_white_fraction)
    text += fmt::format(" --max-white-fraction {}", frontend.max_white_fraction);
  text += " --lens ";
  return text.append(options.choose_lens_model ? "auto" : lens_model_name(options.lens_model));
}

std::string list_changed_camera_options(const SessionOptions& options) {
  const SessionOptions defaults;
  const FrontendOptions &limits = options.frontend, &default_limits = defaults.frontend;
  std::string changed;
  const auto add_if = [&](bool is_changed, const char* name) {
    if (is_changed) changed.append(changed.empty() ? "" : ", ").append(name);
  };
  add_if(options.camera_id != defaults.camera_id, "name");
  add_if(options.choose_lens_model || options.lens_model != defaults.lens_model, "lens model");
  add_if(limits.row_time_s.has_value(), "row time");
  add_if(limits.readout.has_value(), "readout");
  add_if(limits.max_blur_fraction != default_limits.max_blur_fraction ||
             limits.max_white_fraction != default_limits.max_white_fraction,
         "limits of board images");
  return changed;
}

}  // namespace vlp
