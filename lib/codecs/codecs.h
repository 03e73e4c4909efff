// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

/// Codecs of images and videos by OpenCV's imgcodecs and videoio. These load some 240 shared
/// libraries, which takes longer than most programs. They are therefore linked to a library of
/// their own, which is loaded at the first image, and used through these interfaces.
namespace vlp {

/// Reads the frames of a video: cv::VideoCapture behind an interface, with its members, backends
/// (`api`, cv::CAP_FFMPEG) and properties (cv::CAP_PROP_FPS).
class VideoReader {
 public:
  VideoReader() = default;
  virtual ~VideoReader() = default;
  VideoReader(const VideoReader&) = delete;
  VideoReader& operator=(const VideoReader&) = delete;

  virtual bool open(const std::string& source, int api) = 0;
  virtual bool grab() = 0;
  virtual bool retrieve(cv::Mat& frame) = 0;
  virtual double get(int property) const = 0;
  virtual void set(int property, double value) = 0;
};

/// Decodes and encodes images, and opens videos. Its functions can be called from several threads.
class Codecs {
 public:
  Codecs() = default;
  virtual ~Codecs() = default;
  Codecs(const Codecs&) = delete;
  Codecs& operator=(const Codecs&) = delete;

  /// Decodes the bytes of an image file, which stay as they are, with the flags of cv::imread.
  /// Returns an empty matrix if it cannot be decoded. Throws cv::Exception as cv::imdecode does.
  virtual cv::Mat decode(std::string& bytes, int flags) const = 0;

  /// Encodes an image as a file with this ending (".png"), with parameters of cv::imwrite. Throws
  /// std::runtime_error if the image cannot be encoded.
  virtual std::string encode(const std::string& ending, const cv::Mat& image,
                             const std::vector<int>& parameters) const = 0;

  /// Returns true if videos can be read by this backend of cv::VideoCapture, as cv::CAP_FFMPEG.
  virtual bool has_video_backend(int api) const = 0;

  virtual std::unique_ptr<VideoReader> make_video_reader() const = 0;
};

/// Returns the codecs, which are loaded at the first call. Throws std::runtime_error if the library
/// cannot be loaded.
const Codecs& codecs();

}  // namespace vlp
