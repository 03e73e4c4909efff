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

#include "frontend/image_file.h"
#include "frontend/options.h"

namespace vlp {

class Video;

/// Image file that is still to be read, or a frame of a video.
struct SourceImage {
  explicit SourceImage(std::filesystem::path image_file) : file(std::move(image_file)) {}

  /// Path of the image file, or for a frame of a video its name by make_frame_name():
  /// VIDEO#000123.
  std::filesystem::path file;
  /// Pixels of a video's frame; empty for an image file.
  cv::Mat frame = {};
  /// Time of a video's frame since the start of the video; std::nullopt for an image file.
  std::optional<double> time_s = {};
  /// Index of the image in the order of its source, from 0.
  std::size_t index = 0;

  /// Returns the gray levels of the image, 8 or 16 bits; reads the file if it is no video frame.
  /// @throws InputError as read_image()
  cv::Mat read_gray_image(const FrontendOptions& options) const {
    return frame.empty() ? read_image(file, options.max_mpx) : frame;
  }
};

/// Sequence of image files and frames of video files, in their order, for any number of threads.
/// Only the frames that are being processed are in memory.
class ImageSource {
 public:
  /// Creates a source from files, with the frame step and the largest size of `options`.
  /// @throws InputError for a video that cannot be opened, has no frame, is too large, or does not
  ///         have the size `imager_px`
  explicit ImageSource(std::vector<std::filesystem::path> files,
                       const FrontendOptions& options = {},
                       const std::optional<std::array<int, 2>>& imager_px = std::nullopt);
  ~ImageSource();

  /// Returns the next image; std::nullopt at the end.
  std::optional<SourceImage> read_next_image();
  /// Number of images, with the frames that the headers of the videos report.
  std::size_t expected_image_count() const;
  /// Warnings of videos with missing frames among those already read, one line each.
  const std::vector<std::string>& video_warnings() const { return warnings_; }

 private:
  std::optional<SourceImage> read_video_frame();

  std::vector<std::filesystem::path> files_;
  int every_;
  std::size_t expected_ = 0, num_returned_ = 0, file_ = 0;
  std::unique_ptr<Video> video_;
  std::vector<std::string> warnings_;
  std::mutex mutex_;
};

/// Calls process(i) for each image i < `count` on `threads` threads, as parallel_for() does.
/// Switches OpenCV's own threads off for the rest of the process, so that no more than `threads`
/// run.
///
/// @param progress  called with the number of images done; calls do not overlap; may be empty
void process_images(std::size_t count, int threads, const std::function<void(std::size_t)>& process,
                    const std::function<void(std::size_t done)>& progress = {});

/// Calls task(image) for each image of the source on several threads, as
/// process_images().
void for_each_image(ImageSource& source, int threads,
                    const std::function<void(const SourceImage&)>& task);

/// Describes that the size of an image is not that of the camera.
std::string explain_image_size(const std::array<int, 2>& size_px,
                               const std::array<int, 2>& imager_px);

/// Checks that the size of an image is `imager_px` (width, height), if given. Throws InputError
/// otherwise.
void check_image_size(const std::filesystem::path& file, const std::array<int, 2>& size_px,
                      const std::optional<std::array<int, 2>>& imager_px);

}  // namespace vlp
