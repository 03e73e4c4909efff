// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "captures/detections_table.h"
#include "detection/boards/board_detector.h"
#include "frontend/image_source.h"
#include "frontend/options.h"
#include "lamps/shape/light.h"
#include "rig/calibration.h"

namespace vlp {

/// Reason why an image is not used.
enum class RejectionReason {
  unreadable,   // no image, damaged, or larger than FrontendOptions::max_mpx
  wrong_size,   // not of the camera
  too_dark,     // nothing exceeds the noise, or the level of a board
  overexposed,  // too many pixels at full scale
  no_contrast,  // no edge in the image
  blurred,      // by more than FrontendOptions::max_blur_fraction, or for the size of the squares
  other_board,  // tags that the board does not have, and none that it has
  no_board,     // no tag or corner of the board
  too_few_corners,  // they do not determine the pose of the board
  too_few_lamps,    // fewer than the step needs
  same_image,       // a copy of an image that is used
  same_view,        // shows what an image that is used shows
  not_needed,       // came when its step had enough images
  used_elsewhere    // of another camera or run
};

/// Returns a phrase for a message that follows a number of images: "blurred" for "10 blurred",
/// "cannot be read", ...
std::string_view reason_phrase(RejectionReason reason);

/// Returns true if the image has no fault, but other images make it unnecessary.
bool is_redundancy_rejection(RejectionReason reason);

/// Rejection of an image.
struct Rejection {
  RejectionReason reason;
  /// Reason with its measured values, in one human-readable line.
  std::string message;
};

/// Result of the intake of one image: its detections, and the rejection if it is not used.
struct Observation {
  /// Image file, or make_frame_name() (VIDEO#000123) for a frame of a video.
  std::filesystem::path file;
  /// Time of a video's frame since the start of the video; std::nullopt for image files.
  std::optional<double> time_s = {};
  /// Width and height of the image; 0 for an image that cannot be read.
  std::array<int, 2> size_px = {0, 0};
  /// Rejection; std::nullopt if the image is used.
  std::optional<Rejection> rejection = {};
  /// Doubt about an image that is used, with its measured values, in one human-readable line; empty
  /// without one.
  std::string doubt = {};

  /// Board images only: the detection, std::nullopt for images that are unreadable or of another
  /// size; sigma of the blur, std::nullopt for images without contrast.
  std::optional<BoardView> board = {};
  std::optional<double> blur_px = {};

  /// Lamp images only: all lights, without outline points, and the readout direction used.
  std::vector<Light> lights = {};
  Readout readout = Readout::rows;

  bool is_image_kept() const { return !rejection; }
  std::string image_file_name() const { return file.filename().string(); }
  void reject(RejectionReason reason, std::string message) {
    rejection = Rejection{reason, std::move(message)};
  }
};

/// Reason why no image of a set can be used.
struct IntakeFailure {
  /// True if the images contradict `file`; false if the images themselves are unusable.
  bool is_wrong_file;
  std::string message;
  /// File to correct; empty if the images are the cause.
  std::filesystem::path file = {};
};

/// Observations of a set of images, in the order of the images.
struct Observations {
  std::vector<Observation> images;
  /// Messages: warnings, decisions of the program (notes), and details for --verbose.
  std::vector<std::string> warnings = {}, notes = {}, details = {};
  std::optional<IntakeFailure> failure = {};
};

/// Inserts the messages of `remarks` before those of `result`.
void prepend_messages(const Observations& remarks, Observations& result);

/// Returns a detection for each light of kind `lamp`: id, pixel of the center, and its standard
/// deviation.
std::vector<Detection> list_identified_lamps(const Observation& image);

/// Returns the detections of the board in the images that are used, in their order.
std::vector<BoardView> collect_board_views(std::span<const Observation> images);

/// Returns the lamps in the images that are used, one frame per image.
std::vector<Frame> collect_lamp_frames(std::span<const Observation> images);

/// Returns the number of rejected images per reason, for example "10 blurred, 2 too dark". Appends
/// the remedy if one reason applies to more than half of them. Empty if no image is rejected.
std::string summarize_rejected_images(std::span<const Observation> images);

/// Describes that none of the images can be used, with their number per reason.
std::string explain_no_image(std::span<const Observation> images);

/// Checks that at least one image can be read.
/// @throws InputError with the reason of the first image if none can be read
void check_any_readable(const std::filesystem::path& where, std::span<const Observation> images);

/// Reads an image and passes its pixels to `detect`. Rejects the image, with the reason, if it
/// cannot be read, is not of `imager_px`, or makes `detect` throw an exception.
void read_and_detect(const SourceImage& source, const FrontendOptions& options,
                     const std::optional<std::array<int, 2>>& imager_px, Observation& result,
                     const std::function<void(const cv::Mat&)>& detect);

/// Callback with the number of images done and their total, as far as the headers of videos report
/// it. Calls do not overlap.
using IntakeProgress = std::function<void(std::size_t done, std::size_t total)>;

/// Calls `observe` for each image of the source on several threads and returns the results in the
/// order of the images. An image that cannot be used does not end the run.
Observations collect_observations(ImageSource& source, int threads,
                                  const std::function<Observation(const SourceImage&)>& observe,
                                  const IntakeProgress& progress = {});

/// Use of a set of images, which determines the reasons for a rejection.
enum class ImageUse {
  boards,           // calibration of the lens: rejects repeated images and views
  rotation,         // rejects repeated images and views, and fewer than two lamps
  known_positions,  // rejects repeated images, and fewer than two lamps
  fixes             // captures to locate: rejects no image for its content
};

/// Filter for images that repeat an image in use. Two images show the same view if they share at
/// least 70 % of their corners (or lamps). In addition, their RMS distance is at most
/// `same_view_fraction` of the image width. They are copies if corners (or lamps) are identical.
class Selection {
 public:
  Selection(ImageUse use, const FrontendOptions& options)
      : use_(use), same_view_fraction_(options.same_view_fraction) {}

  /// Rejects the image if it repeats one that was added or kept before. Does not change images that
  /// are already rejected or have no corners or lamps.
  void add_or_reject(Observation& image);

  /// Adds an image that is used anyway. Later images that repeat it are rejected.
  void add_kept_image(const Observation& image);

 private:
  struct Kept {
    std::string name;
    std::vector<PointDetection> points;
  };
  ImageUse use_;
  double same_view_fraction_;
  std::vector<Kept> kept_;
};

/// Rejects images that repeat an earlier one, by a Selection, in the order of `images`.
void reject_repeated_images(std::vector<Observation>& images, ImageUse use,
                            const FrontendOptions& options);

/// Returns the minimum number of lamps that an image needs.
int min_lamps_for_use(ImageUse use);

}  // namespace vlp
