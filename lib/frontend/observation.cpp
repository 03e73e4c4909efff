// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/observation.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <map>
#include <mutex>
#include <utility>

#include "lamps/light_detector.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

/// Returns a message without the name of the file that it begins with, in one line.
std::string make_one_line_message(const std::filesystem::path& file, const std::exception& error) {
  std::string message = error.what();
  std::replace(message.begin(), message.end(), '\n', ' ');
  const std::string prefix = file.string() + ": ";
  return message.starts_with(prefix) ? message.substr(prefix.size()) : message;
}

/// Phrase that follows a number of images, and remedy if there is one.
struct ReasonText {
  RejectionReason reason;
  std::string_view phrase, remedy = "";
};

constexpr std::array kReasons{
    ReasonText{RejectionReason::unreadable, "cannot be read"},
    ReasonText{RejectionReason::wrong_size, "of another size"},
    ReasonText{RejectionReason::too_dark, "too dark", ": more exposure, gain or light"},
    ReasonText{RejectionReason::overexposed, "overexposed", ": less exposure, gain or light"},
    ReasonText{RejectionReason::no_contrast, "without contrast"},
    ReasonText{RejectionReason::blurred, "blurred",
               ": focus the lens, or keep camera and board still"},
    ReasonText{RejectionReason::other_board, "with tags of another board"},
    ReasonText{RejectionReason::no_board, "without the board"},
    ReasonText{RejectionReason::too_few_corners, "with too little of the board"},
    ReasonText{RejectionReason::too_few_lamps, "with too few lamps"},
    ReasonText{RejectionReason::same_image, "the same image again"},
    ReasonText{RejectionReason::same_view, "the same view again"},
    ReasonText{RejectionReason::not_needed, "not needed"},
    ReasonText{RejectionReason::used_elsewhere, "used elsewhere"}};

const ReasonText& get_text(RejectionReason reason) {
  return *std::ranges::find(kReasons, reason, &ReasonText::reason);
}

}  // namespace

std::string_view reason_phrase(RejectionReason reason) { return get_text(reason).phrase; }

bool is_redundancy_rejection(RejectionReason reason) {
  return reason == RejectionReason::same_image || reason == RejectionReason::same_view ||
         reason == RejectionReason::not_needed;
}

void prepend_messages(const Observations& remarks, Observations& result) {
  result.warnings.insert(result.warnings.begin(), remarks.warnings.begin(), remarks.warnings.end());
  result.notes.insert(result.notes.begin(), remarks.notes.begin(), remarks.notes.end());
}

std::vector<Detection> list_identified_lamps(const Observation& image) {
  return select_lamps(image.lights);
}

std::vector<BoardView> collect_board_views(std::span<const Observation> images) {
  std::vector<BoardView> views;
  for (const Observation& image : images) {
    if (image.is_image_kept() && image.board) views.push_back(*image.board);
  }
  return views;
}

std::vector<Frame> collect_lamp_frames(std::span<const Observation> images) {
  std::vector<Frame> frames;
  for (const Observation& image : images) {
    if (image.is_image_kept())
      frames.push_back({image.image_file_name(), list_identified_lamps(image)});
  }
  return frames;
}

std::string summarize_rejected_images(std::span<const Observation> images) {
  std::map<std::pair<RejectionReason, std::string>, int> counts;
  std::map<std::pair<RejectionReason, std::string>, std::string> remedies;
  int rejected = 0;
  for (const Observation& image : images) {
    if (image.is_image_kept()) continue;
    const auto& [reason, message] = *image.rejection;
    // The message names the run of the image; the text after the colon is the remedy.
    const bool has_owner = reason == RejectionReason::used_elsewhere;
    const auto colon = std::min(message.find(':'), message.size());
    const std::pair key(reason,
                        has_owner ? message.substr(0, colon) : reason_phrase(reason).data());
    remedies[key] = has_owner ? message.substr(colon) : get_text(reason).remedy;
    ++counts[key];
    ++rejected;
  }
  std::string text, remedy;
  for (const auto& [key, count] : counts) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, key.second);
    if (2 * count > rejected) remedy = remedies[key];
  }
  return text.append(remedy);
}

std::string explain_no_image(std::span<const Observation> images) {
  return fmt::format("none of the {} images can be used: {}", images.size(),
                     summarize_rejected_images(images));
}

void check_any_readable(const std::filesystem::path& where, std::span<const Observation> images) {
  const auto is_readable = [](const Observation& image) {
    return image.is_image_kept() || (image.rejection->reason != RejectionReason::unreadable &&
                                     image.rejection->reason != RejectionReason::wrong_size);
  };
  if (std::any_of(images.begin(), images.end(), is_readable)) return;
  std::string message = fmt::format("none of its {} images can be used", images.size());
  if (!images.empty()) {
    message += fmt::format("; the first, {}: {}", images.front().image_file_name(),
                           images.front().rejection->message);
  }
  throw InputError(where, message);
}

void read_and_detect(const SourceImage& source, const FrontendOptions& options,
                     const std::optional<std::array<int, 2>>& imager_px, Observation& result,
                     const std::function<void(const cv::Mat&)>& detect) {
  RejectionReason reason = RejectionReason::unreadable;
  try {
    const cv::Mat image = source.read_gray_image(options);
    result.size_px = {image.cols, image.rows};
    reason = RejectionReason::wrong_size;
    check_image_size(source.file, result.size_px, imager_px);
    reason = RejectionReason::unreadable;
    detect(image);
  } catch (const InputError& error) {
    result.reject(reason, make_one_line_message(source.file, error));
  } catch (const std::exception& error) {
    result.reject(reason, "cannot be used: " + make_one_line_message(source.file, error));
  }
}

Observations collect_observations(ImageSource& source, int threads,
                                  const std::function<Observation(const SourceImage&)>& observe,
                                  const IntakeProgress& progress) {
  Observations result;
  std::mutex counting;
  std::size_t done = 0;
  for_each_image(source, threads, [&](const SourceImage& image) {
    Observation observation = observe(image);
    const std::lock_guard lock(counting);
    if (result.images.size() <= image.index) result.images.resize(image.index + 1);
    result.images[image.index] = std::move(observation);
    ++done;
    if (progress) progress(done, std::max(done, source.expected_image_count()));
  });
  result.warnings = source.video_warnings();
  return result;
}

namespace {

/// Returns the corners of the board, or the lamps by their ids, sorted by index.
std::vector<PointDetection> get_points_in(const Observation& image) {
  if (image.board) return collect_detected_corners(image.board->detection);
  std::vector<PointDetection> points;
  for (const Detection& lamp : list_identified_lamps(image)) {
    points.push_back({static_cast<std::size_t>(lamp.lamp), lamp.pixel});
  }
  std::sort(points.begin(), points.end(),
            [](const PointDetection& a, const PointDetection& b) { return a.index < b.index; });
  return points;
}

bool are_points_equal(const std::vector<PointDetection>& a, const std::vector<PointDetection>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const PointDetection& one, const PointDetection& two) {
                      return one.index == two.index && one.pixel == two.pixel;
                    });
}

bool are_points_close(const std::vector<PointDetection>& a, const std::vector<PointDetection>& b,
                      double max_distance_px) {
  constexpr double min_shared_fraction = 0.7;
  double sum_px2 = 0, shared = 0;
  auto other = b.begin();
  for (const PointDetection& point : a) {
    while (other != b.end() && other->index < point.index) ++other;
    if (other == b.end()) break;
    if (other->index != point.index) continue;
    ++shared;
    sum_px2 += (point.pixel - other->pixel).squaredNorm();
  }
  const auto larger = static_cast<double>(std::max(a.size(), b.size()));
  return shared >= min_shared_fraction * larger && std::sqrt(sum_px2 / shared) <= max_distance_px;
}

}  // namespace

int min_lamps_for_use(ImageUse use) {
  return use == ImageUse::rotation || use == ImageUse::known_positions ? 2 : 0;
}

void Selection::add_or_reject(Observation& image) {
  if (!image.is_image_kept() || use_ == ImageUse::fixes) return;
  std::vector<PointDetection> points = get_points_in(image);
  if (points.empty()) return;
  for (const Kept& kept : kept_) {
    if (!are_points_equal(points, kept.points)) continue;
    // [FILE-10] `the same image`, `the same view` | copy, or view within 1 % of the image width of
    //   another | move the board, or rotate the camera
    return image.reject(RejectionReason::same_image, "is the same image as " + kept.name);
  }
  if (use_ != ImageUse::known_positions) {
    for (const Kept& kept : kept_) {
      if (!are_points_close(points, kept.points, same_view_fraction_ * image.size_px[0])) continue;
      return image.reject(RejectionReason::same_view,
                          "shows the same view as " + kept.name + ": views count once");
    }
  }
  kept_.push_back({image.image_file_name(), std::move(points)});
}

void Selection::add_kept_image(const Observation& image) {
  if (use_ != ImageUse::fixes) kept_.push_back({image.image_file_name(), get_points_in(image)});
}

void reject_repeated_images(std::vector<Observation>& images, ImageUse use,
                            const FrontendOptions& options) {
  Selection selection(use, options);
  for (Observation& image : images) selection.add_or_reject(image);
}

}  // namespace vlp
