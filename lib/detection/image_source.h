// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "detection/image_file.h"

namespace vlp {

class Video;

/// An image to look at: a file that is still to be read, or a frame of a video.
struct SourceImage {
  explicit SourceImage(std::filesystem::path image_file) : file(std::move(image_file)) {}

  /// Of a frame VIDEO#000123, frame_name().
  std::filesystem::path file;
  /// Of a video; empty when the image is in the file.
  cv::Mat frame = {};
  /// Of a video's frame, since the video's start.
  std::optional<double> time_s = {};
  /// Its place among all of them.
  std::size_t index = 0;

  /// The grey levels. Throws what read_image() throws.
  cv::Mat read(double max_mpx) const { return frame.empty() ? read_image(file, max_mpx) : frame; }
};

/// What is taken of videos; images are looked at when they are read.
struct FromVideos {
  /// Every so many-th frame.
  int every = 1;
  double max_mpx = kUsualMaxMpx;
  /// What they have to have, the camera's.
  std::optional<std::array<int, 2>> imager_px = std::nullopt;
};

/// Image files and the frames of video files, in their order, for any number of threads. Of a video
/// there is a frame at a time in memory, and those that are looked at.
class ImageSource {
 public:
  /// Throws InputError for a video that cannot be opened, without a frame, or of a size that is not
  /// to be.
  explicit ImageSource(std::vector<std::filesystem::path> files,
                       const FromVideos& from_videos = {});
  ~ImageSource();

  /// The next one; nothing at the end.
  std::optional<SourceImage> next();
  /// How many there are, as far as the videos tell.
  std::size_t expected() const;
  /// Videos that lack frames, so far, in one line each.
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  std::optional<SourceImage> next_frame();

  std::vector<std::filesystem::path> files_;
  FromVideos from_videos_;
  std::size_t expected_ = 0, given_ = 0, file_ = 0;
  std::unique_ptr<Video> video_;
  std::vector<std::string> warnings_;
  std::mutex taking_;
};

/// Calls task(image) for each image of the source, on so many threads, as images_in_parallel().
void for_each_image(ImageSource& source, int threads,
                    const std::function<void(const SourceImage&)>& task);

/// Throws InputError when an image of this size is not of `imager_px`.
void check_imager(const std::filesystem::path& file, const cv::Size& size,
                  const std::optional<std::array<int, 2>>& imager_px);

}  // namespace vlp
