// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

namespace vlp {

/// Whether the name is that of a video, by its ending: AVI, MP4, M4V, MOV, MKV, WebM, MPG, MPEG.
bool is_video_name(const std::filesystem::path& file);

/// VIDEO#000123: what stands for the name of an image where the image is a frame. From 0, of the
/// frames that can be decoded.
std::string frame_name(const std::string& video, std::size_t number);

/// VIDEO of VIDEO#000123; nothing when it is no such name.
std::optional<std::string> video_of_frame(const std::string& name);

struct VideoFrame {
  /// Grey, of 8 bits.
  cv::Mat1b image;
  std::size_t number;
  /// Since the video's start, by the frame's time stamp.
  double time_s;
};

/// The frames of a video file, of a URL or of a camera (/dev/video0, by V4L2), through OpenCV, one
/// at a time. Turns that the file asks for are not made, because the shutter does not turn.
class Video {
 public:
  /// A camera is asked for frames of `camera_px`. Throws InputError when it cannot be opened.
  explicit Video(const std::string& source,
                 const std::optional<std::array<int, 2>>& camera_px = std::nullopt);
  ~Video();
  Video(const Video&) = delete;
  Video& operator=(const Video&) = delete;

  /// The next frame that can be decoded; nothing at the end.
  std::optional<VideoFrame> next();
  /// Goes past the next frame.
  void skip();

  bool is_camera() const;
  std::array<int, 2> size_px() const;
  /// How many frames the file says that it has; 0 when it does not.
  std::size_t frames_stated() const;
  /// That frames are missing, in one line without the file's name; empty when all are there. After
  /// the end only.
  std::string missing() const;

 private:
  bool grab();

  struct Capture;
  std::string source_;
  std::unique_ptr<Capture> capture_;
  std::size_t grabbed_ = 0;
  /// The last frame that was given, and its time.
  std::optional<std::size_t> last_;
  double last_s_ = -1;
  bool gap_ = false, ended_ = false;
};

}  // namespace vlp
