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

/// Returns true if the extension is that of a video: AVI, MP4, M4V, MOV, MKV, WebM, MPG, MPEG.
bool is_video_file_name(const std::filesystem::path& file);

/// Returns the name of a video frame, which replaces the name of an image file: VIDEO#000123.
/// @param video   name of the video
/// @param number  index of the frame from 0, among the frames that can be decoded
std::string make_frame_name(const std::string& video, std::size_t number);

/// Parses the name of a frame, VIDEO#000123, and returns VIDEO; std::nullopt for other names.
std::optional<std::string> parse_video_name(const std::string& name);

/// Decoded frame of a video.
struct VideoFrame {
  /// Gray levels of the frame, 8 bits.
  cv::Mat1b image;
  /// Index of the frame in the video, from 0, among the frames that can be decoded.
  std::size_t number;
  /// Time since the start of the video, from the time stamp of the frame.
  double time_s;
};

/// Reader of the frames of a video file, a URL or a camera (/dev/video0, by V4L2), through OpenCV.
/// A rotation tag in the file is ignored, because the readout direction does not rotate with it.
class Video {
 public:
  /// Opens a video. A camera is configured for frames of size `camera_px`.
  /// @throws InputError if the video cannot be opened
  explicit Video(const std::string& source,
                 const std::optional<std::array<int, 2>>& camera_px = std::nullopt);
  ~Video();
  Video(const Video&) = delete;
  Video& operator=(const Video&) = delete;

  /// Returns the next frame that can be decoded; std::nullopt at the end.
  std::optional<VideoFrame> read_next_frame();
  /// Skips the next frame.
  void skip_video_frame();

  bool is_live_camera() const;
  std::array<int, 2> frame_size_px() const;
  /// Number of frames according to the header of the file; 0 if unknown.
  std::size_t reported_frame_count() const;
  /// Describes missing frames in one line without the file name; empty if there are none.
  /// @pre The end of the video has been reached.
  std::string describe_missing_frames() const;

 private:
  bool grab_frame();

  struct Capture;
  std::string source_;
  std::unique_ptr<Capture> capture_;
  std::size_t grabbed_ = 0;
  /// Number and time of the last frame that read_next_frame() returned.
  std::optional<std::size_t> last_;
  double last_s_ = -1;
  bool gap_ = false, ended_ = false;
};

}  // namespace vlp
