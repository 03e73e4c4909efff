// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/video.h"

#include <fmt/core.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "codecs/codecs.h"
#include "frontend/image_file.h"
#include "rig/file.h"
#include "rig/input_error.h"

namespace vlp {

bool is_video_file_name(const std::filesystem::path& file) {
  return has_file_extension(file,
                            {".avi", ".mp4", ".m4v", ".mov", ".mkv", ".webm", ".mpg", ".mpeg"});
}

std::string make_frame_name(const std::string& video, std::size_t number) {
  return fmt::format("{}#{:06}", video, number);
}

std::optional<std::string> parse_video_name(const std::string& name) {
  const auto mark = name.rfind('#');
  if (mark == std::string::npos || mark + 1 == name.size() ||
      name.find_first_not_of("0123456789", mark + 1) != std::string::npos ||
      !is_video_file_name(name.substr(0, mark))) {
    return {};
  }
  return name.substr(0, mark);
}

struct Video::Capture {
  std::unique_ptr<VideoReader> reader = get_codecs().make_video_reader();
};

Video::Video(const std::string& source, const std::optional<std::array<int, 2>>& camera_px)
    : source_(source), capture_(std::make_unique<Capture>()) {
  // Messages of OpenCV and FFmpeg about each backend that fails to open a video are suppressed.
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  ::setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);
  const bool is_url = source.find("://") != std::string::npos;
  if (!is_url && !std::filesystem::exists(source)) {
    throw InputError(source, is_live_camera() ? "there is no such camera: is it connected?"
                                              : "there is no such video");
  }
  // FFmpeg would wait for the writer of a pipe.
  if (!is_url && !is_live_camera()) InputFile(source, std::numeric_limits<std::size_t>::max());
  // OpenCV would also try to read a file as a sequence of images.
  const bool has_ffmpeg = get_codecs().has_video_backend(cv::CAP_FFMPEG);
  const int file_api = !is_url && has_ffmpeg ? cv::CAP_FFMPEG : cv::CAP_ANY;
  VideoReader& video = *capture_->reader;
  if (!video.open_video(source, is_live_camera() ? cv::CAP_V4L2 : file_api)) {
    // [FILE-1]
    // [FILE-8] `cannot be opened as a video` | codec missing in OpenCV, or end missing (MP4 not
    //   closed) | record or convert again
    throw InputError(source, is_live_camera()
                                 ? "cannot be opened as a camera"
                                 : "cannot be opened as a video: is it cut short, or none?");
  }
  video.set_video_property(cv::CAP_PROP_ORIENTATION_AUTO, 0);
  if (!is_live_camera() || !camera_px) return;
  video.set_video_property(cv::CAP_PROP_FRAME_WIDTH, (*camera_px)[0]);
  video.set_video_property(cv::CAP_PROP_FRAME_HEIGHT, (*camera_px)[1]);
  video.set_video_property(cv::CAP_PROP_BUFFERSIZE,
                           1);  // returns the current frame, not a buffered one
}

Video::~Video() = default;

bool Video::is_live_camera() const { return source_.starts_with("/dev/"); }

std::array<int, 2> Video::frame_size_px() const {
  const auto of = [&](int property) {
    return static_cast<int>(capture_->reader->get_video_property(property));
  };
  return {of(cv::CAP_PROP_FRAME_WIDTH), of(cv::CAP_PROP_FRAME_HEIGHT)};
}

std::size_t Video::reported_frame_count() const {
  constexpr double max_frames = 1e9;
  const double reported = capture_->reader->get_video_property(cv::CAP_PROP_FRAME_COUNT);
  return reported > 0 && reported < max_frames ? static_cast<std::size_t>(reported) : 0;
}

/// Grabs the next frame. OpenCV fails several times after a frame that cannot be decoded and then
/// continues.
bool Video::grab_frame() {
  constexpr int max_tries = 100;
  if (ended_) return false;
  const std::size_t reported = is_live_camera() ? 0 : reported_frame_count();
  const int tries = grabbed_ < reported ? max_tries : 1;
  for (int i = 0; i < tries; ++i) {
    if (!capture_->reader->grab_frame()) continue;
    gap_ = gap_ || i > 0;
    ++grabbed_;
    return true;
  }
  ended_ = true;
  return false;
}

std::optional<VideoFrame> Video::read_next_frame() {
  cv::Mat frame;
  do {
    if (!grab_frame()) return {};
  } while (!capture_->reader->retrieve_frame(frame) || frame.empty());
  VideoFrame next{
      {}, grabbed_ - 1, capture_->reader->get_video_property(cv::CAP_PROP_POS_MSEC) / 1000};
  if (frame.channels() == 1) {
    next.image = frame.clone();  // OpenCV overwrites the buffer with the next frame
  } else {
    cv::cvtColor(frame, next.image, cv::COLOR_BGR2GRAY);
  }
  // Some decoders lose the time stamps of the last frames.
  const double rate = capture_->reader->get_video_property(cv::CAP_PROP_FPS);
  if (!(next.time_s > last_s_) && last_ && rate > 0) {
    next.time_s = last_s_ + static_cast<double>(next.number - *last_) / rate;
  }
  last_ = next.number;
  last_s_ = next.time_s;
  return next;
}

void Video::skip_video_frame() { grab_frame(); }

std::string Video::describe_missing_frames() const {
  const std::size_t reported = reported_frame_count();
  // Other formats only estimate the number of frames from their duration.
  const std::string kind = std::filesystem::path(source_).extension().string();
  const bool exact = kind == ".avi" || kind == ".mp4" || kind == ".mov" || kind == ".m4v";
  const std::size_t tolerated = exact || gap_ ? 0 : 1 + reported / 50;
  if (grabbed_ + tolerated >= reported) return "";
  return fmt::format("{} of its {} frames can be decoded; is it cut short, or damaged?", grabbed_,
                     reported);
}

}  // namespace vlp
