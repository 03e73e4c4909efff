// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/frame_source.h"

#include <fmt/core.h>

#include "codecs/codecs.h"
#include "rig/input_error.h"

namespace vlp {

std::filesystem::path FrameSource::save_next(const SharedFolder& folder) {
  folder.check_place();
  const auto frame = ended_ ? std::nullopt : video_.next();
  if (!frame) {
    if (video_.is_camera()) throw InputError(source_, "the camera gives no frame");
    ended_ = true;
    return {};
  }
  const std::string content = codecs().encode(".png", frame->image, {});
  // A continued run does not overwrite its frames.
  std::string name;
  do {
    name = fmt::format("frame-{:06}.png", frames_++);
  } while (folder.has(name));
  folder.replace(name, content);
  return folder.path() / name;
}

}  // namespace vlp
