// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/frame_source.h"

#include <fmt/core.h>

#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <string_view>
#include <vector>

#include "rig/file.h"
#include "rig/input_error.h"

namespace vlp {

namespace {

bool is_camera(const std::string& source) { return source.starts_with("/dev/"); }

}  // namespace

struct FrameSource::Capture {
  cv::VideoCapture video;
};

FrameSource::FrameSource(const std::string& source, const std::array<int, 2>& imager_px)
    : source_(source), capture_(std::make_unique<Capture>()) {
  // What OpenCV says of each of its ways to open a video is nothing to the operator.
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  const bool is_url = source.find("://") != std::string::npos;
  if (!is_url && !std::filesystem::exists(source)) {
    throw InputError(source, is_camera(source) ? "there is no such camera: is it connected?"
                                               : "there is no such video");
  }
  if (!capture_->video.open(source, is_camera(source) ? cv::CAP_V4L2 : cv::CAP_ANY)) {
    throw InputError(source, "cannot be opened as a camera or a video");
  }
  if (!is_camera(source)) return;
  capture_->video.set(cv::CAP_PROP_FRAME_WIDTH, imager_px[0]);
  capture_->video.set(cv::CAP_PROP_FRAME_HEIGHT, imager_px[1]);
  capture_->video.set(cv::CAP_PROP_BUFFERSIZE, 1);  // what it sees now, not some frames ago
}

FrameSource::~FrameSource() = default;

std::filesystem::path FrameSource::save_next(const std::filesystem::path& folder) {
  cv::Mat frame, grey;
  if (ended_ || !capture_->video.read(frame) || frame.empty()) {
    if (is_camera(source_)) throw InputError(source_, "the camera gives no frame");
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
