// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <vector>

namespace vlp {

/// Writes gray images as a video of 20 frames a second, by a lossless codec (FFV1) or that with the
/// four letters `codec`. Returns false if OpenCV lacks the codec.
inline bool write_video(const std::filesystem::path& file, const std::vector<cv::Mat>& images,
                        const char* codec = "FFV1") {
  constexpr double rate_hz = 20;
  cv::VideoWriter video(file.string(), cv::CAP_FFMPEG,
                        cv::VideoWriter::fourcc(codec[0], codec[1], codec[2], codec[3]), rate_hz,
                        images.front().size(), false);
  if (!video.isOpened()) return false;
  for (const cv::Mat& image : images) video.write(image);
  return true;
}

}  // namespace vlp
