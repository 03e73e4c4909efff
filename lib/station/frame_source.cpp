// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/frame_source.h"

#include <fmt/core.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <string_view>
#include <vector>

#include "rig/file.h"
#include "rig/input_error.h"

namespace vlp {

struct FrameSource::Capture {
  cv::VideoCapture video;
};

FrameSource::FrameSource(const std::string& source) : capture_(std::make_unique<Capture>()) {
  const bool device = source.starts_with("/dev/");
  if (!capture_->video.open(source, device ? cv::CAP_V4L2 : cv::CAP_ANY)) {
    throw InputError(source, "cannot be opened as a camera or a video");
  }
}

FrameSource::~FrameSource() = default;

std::filesystem::path FrameSource::save_next(const std::filesystem::path& folder) {
  cv::Mat frame, grey;
  if (ended_ || !capture_->video.read(frame) || frame.empty()) {
    ended_ = true;
    return {};
  }
  if (frame.channels() == 1) {
    grey = frame;
  } else {
    cv::cvtColor(frame, grey, cv::COLOR_BGR2GRAY);
  }
  std::vector<unsigned char> bytes;
  cv::imencode(".png", grey, bytes);
  std::string content(bytes.begin(), bytes.end());
  // A run that goes on does not write over the frames that it has.
  std::filesystem::path file;
  do {
    file = folder / fmt::format("frame-{:06}.png", frames_++);
  } while (std::filesystem::exists(file));
  write_file(file, content);
  return file;
}

}  // namespace vlp
