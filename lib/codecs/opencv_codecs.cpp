// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <opencv2/videoio/registry.hpp>
#include <stdexcept>

#include "codecs/codecs.h"

namespace vlp {
namespace {

class OpencvVideoReader : public VideoReader {
 public:
  bool open_video(const std::string& source, int api) override { return video_.open(source, api); }
  bool grab_frame() override { return video_.grab(); }
  bool retrieve_frame(cv::Mat& frame) override { return video_.retrieve(frame); }
  double get_video_property(int property) const override { return video_.get(property); }
  void set_video_property(int property, double value) override { video_.set(property, value); }

 private:
  cv::VideoCapture video_;
};

class OpencvCodecs : public Codecs {
 public:
  cv::Mat decode_image(std::string& bytes, int flags) const override {
    return cv::imdecode(cv::Mat(1, static_cast<int>(bytes.size()), CV_8U, bytes.data()), flags);
  }

  std::string encode_image_file(const std::string& ending, const cv::Mat& image,
                                const std::vector<int>& parameters) const override {
    std::vector<unsigned char> bytes;
    if (!cv::imencode(ending, image, bytes, parameters)) {
      throw std::runtime_error("the image cannot be encoded as " + ending);
    }
    return {bytes.begin(), bytes.end()};
  }

  bool has_video_backend(int api) const override {
    return cv::videoio_registry::hasBackend(static_cast<cv::VideoCaptureAPIs>(api));
  }

  std::unique_ptr<VideoReader> make_video_reader() const override {
    return std::make_unique<OpencvVideoReader>();
  }
};

}  // namespace
}  // namespace vlp

/// The function that get_codecs() calls.
extern "C" __attribute__((visibility("default"))) const vlp::Codecs* vlp_codecs() {
  static const vlp::OpencvCodecs codecs;
  return &codecs;
}
