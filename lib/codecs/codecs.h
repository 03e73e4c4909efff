// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

/// Codecs of images and videos by OpenCV's imgcodecs and videoio, used through these interfaces.
/// Both load about 240 shared libraries, which takes longer than most programs run. A separate
/// library is therefore linked to them and loaded at the first image or video that needs it. Gray
/// PNG images do not (decode_gray_image()).
namespace vlp {

/// Abstract interface to cv::VideoCapture, which reads the frames of a video or a camera. The
/// members have the arguments and results of its open(), grab(), retrieve(), get() and set():
/// `api` is a backend (for example cv::CAP_FFMPEG), `property` one of cv::VideoCaptureProperties.
/// set_video_property() has no result.
class VideoReader {
 public:
  VideoReader() = default;
  virtual ~VideoReader() = default;
  VideoReader(const VideoReader&) = delete;
  VideoReader& operator=(const VideoReader&) = delete;

  virtual bool open_video(const std::string& source, int api) = 0;
  virtual bool grab_frame() = 0;
  virtual bool retrieve_frame(cv::Mat& frame) = 0;
  virtual double get_video_property(int property) const = 0;
  virtual void set_video_property(int property, double value) = 0;
};

/// Decoder and encoder of images, and factory of video readers. Several threads can call its
/// functions at the same time.
class Codecs {
 public:
  Codecs() = default;
  virtual ~Codecs() = default;
  Codecs(const Codecs&) = delete;
  Codecs& operator=(const Codecs&) = delete;

  /// Decodes the bytes of an image file with the flags of cv::imread. The bytes are not changed.
  /// Returns an empty matrix if they cannot be decoded.
  /// @throws cv::Exception as cv::imdecode does
  virtual cv::Mat decode_image(std::string& bytes, int flags) const = 0;

  /// Encodes an image as the bytes of a file.
  ///
  /// @param ending      file name extension, for example ".png"
  /// @param parameters  as for cv::imwrite
  /// @throws            std::runtime_error if the image cannot be encoded
  virtual std::string encode_image_file(const std::string& ending, const cv::Mat& image,
                                        const std::vector<int>& parameters) const = 0;

  /// Returns true if this backend of cv::VideoCapture can read videos, for example cv::CAP_FFMPEG.
  virtual bool has_video_backend(int api) const = 0;

  virtual std::unique_ptr<VideoReader> make_video_reader() const = 0;
};

/// Returns the codecs. Loads their library at the first call.
/// @throws std::runtime_error if the library cannot be loaded
const Codecs& get_codecs();

/// Decodes the bytes of an image file, which are not changed, as a gray image with the bit depth of
/// the file. Ignores an orientation in the file. Returns an empty matrix if they cannot be decoded.
///
/// Gray PNG images with 8 or 16 bits are decoded by libpng alone, all others by get_codecs(). The
/// pixels are identical.
/// @throws cv::Exception as cv::imdecode does
/// @throws std::runtime_error if the library of the decoder cannot be loaded
cv::Mat decode_gray_image(std::string& bytes);

}  // namespace vlp
