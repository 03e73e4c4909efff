// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/camera_source.h"

#include <fmt/core.h>

#include "codecs/codecs.h"
#include "rig/input_error.h"

namespace vlp {

StepSources::StepSources(const std::vector<std::string>& sources,
                         const std::array<int, 2>& imager_px) {
  std::shared_ptr<FrameSource> default_source;
  for (const std::string& source : sources) {
    bool named = false;
    for (const StationStep step : kStationSteps) {
      const std::string prefix = std::string(station_step_name(step)) + "=";
      if (!source.starts_with(prefix)) continue;
      by_step_[step] = std::make_shared<FrameSource>(source.substr(prefix.size()), imager_px);
      named = true;
    }
    if (!named) default_source = std::make_shared<FrameSource>(source, imager_px);
  }
  if (!default_source) return;
  for (const StationStep step : kStationSteps) by_step_.emplace(step, default_source);
}

void StepSources::write_next_frame(const Unit& unit, WatchedRun& run) {
  if (!last_.empty() && std::filesystem::exists(last_)) {
    const std::string name = last_.filename().string();
    const auto& images = unit.step_state(last_step_).images;
    const auto image = images.find(name);
    if (image == images.end()) return;
    if (!image->second.is_image_used()) run.delete_rejected(last_step_, name);
  }
  last_.clear();
  const auto step = unit.first_incomplete();
  if (!step || !by_step_.contains(*step)) return;
  last_ = by_step_.at(*step)->save_next_frame(run.step_folder(*step));
  last_step_ = *step;
}

bool StepSources::has_video_ended(const Unit& unit) const {
  const auto step = unit.first_incomplete();
  return step && last_.empty() && by_step_.contains(*step) &&
         by_step_.at(*step)->has_source_ended();
}

std::filesystem::path FrameSource::save_next_frame(const SharedFolder& folder) {
  folder.check_not_replaced();
  const auto frame = ended_ ? std::nullopt : video_.read_next_frame();
  if (!frame) {
    if (video_.is_live_camera()) throw InputError(source_, "the camera gives no frame");
    ended_ = true;
    return {};
  }
  const std::string content = get_codecs().encode_image_file(".png", frame->image, {});
  // A continued run does not overwrite its frames.
  std::string name;
  do {
    name = fmt::format("frame-{:06}.png", frames_++);
  } while (folder.contains(name));
  folder.replace_file(name, content);
  return folder.folder_path() / name;
}

}  // namespace vlp
