// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/observation.h"

#include <fmt/core.h>

#include <algorithm>
#include <exception>
#include <map>
#include <mutex>
#include <utility>

#include "rig/input_error.h"

namespace vlp {
namespace {

/// Returns a message without the name of the file that it begins with, in one line.
std::string message_about(const std::filesystem::path& file, const std::exception& error) {
  std::string message = error.what();
  std::replace(message.begin(), message.end(), '\n', ' ');
  const std::string prefix = file.string() + ": ";
  return message.starts_with(prefix) ? message.substr(prefix.size()) : message;
}

std::string_view remedy_for(RejectionReason reason) {
  switch (reason) {
    case RejectionReason::too_dark:
      return ": more exposure, gain or light";
    case RejectionReason::overexposed:
      return ": less exposure, gain or light";
    case RejectionReason::blurred:
      return ": focus the lens, or keep camera and board still";
    default:
      return "";
  }
}

}  // namespace

std::string_view to_string(RejectionReason reason) {
  switch (reason) {
    case RejectionReason::unreadable:
      return "cannot be read";
    case RejectionReason::wrong_size:
      return "of another size";
    case RejectionReason::too_dark:
      return "too dark";
    case RejectionReason::overexposed:
      return "overexposed";
    case RejectionReason::no_contrast:
      return "without contrast";
    case RejectionReason::blurred:
      return "blurred";
    case RejectionReason::other_board:
      return "with tags of another board";
    case RejectionReason::no_board:
      return "without the board";
    case RejectionReason::too_few_corners:
      return "with too little of the board";
    case RejectionReason::too_few_lamps:
      return "with too few lamps";
    case RejectionReason::same_image:
      return "the same image again";
    case RejectionReason::same_view:
      return "the same view again";
    case RejectionReason::not_needed:
      return "not needed";
    case RejectionReason::used_elsewhere:
      return "used elsewhere";
  }
  return "";
}

bool is_redundant(RejectionReason reason) {
  return reason == RejectionReason::same_image || reason == RejectionReason::same_view ||
         reason == RejectionReason::not_needed;
}

void prepend_remarks(const Observations& remarks, Observations& result) {
  result.warnings.insert(result.warnings.begin(), remarks.warnings.begin(), remarks.warnings.end());
  result.notes.insert(result.notes.begin(), remarks.notes.begin(), remarks.notes.end());
}

std::vector<Detection> collect_lamps(const Observation& image) {
  std::vector<Detection> lamps;
  for (const Light& light : image.lights) {
    if (light.kind == LightKind::lamp) lamps.push_back({*light.lamp, light.pixel, light.sigma_px});
  }
  return lamps;
}

std::vector<BoardView> collect_kept_views(std::span<const Observation> images) {
  std::vector<BoardView> views;
  for (const Observation& image : images) {
    if (image.is_kept() && image.board) views.push_back(*image.board);
  }
  return views;
}

std::vector<Frame> collect_kept_frames(std::span<const Observation> images) {
  std::vector<Frame> frames;
  for (const Observation& image : images) {
    if (image.is_kept()) frames.push_back({image.name(), collect_lamps(image)});
  }
  return frames;
}

std::string summarize_rejections(std::span<const Observation> images) {
  std::map<std::pair<RejectionReason, std::string>, int> counts;
  std::map<std::pair<RejectionReason, std::string>, std::string> remedies;
  int rejected = 0;
  for (const Observation& image : images) {
    if (image.is_kept()) continue;
    const auto& [reason, message] = *image.rejection;
    // The message names the run of the image; the text after the colon is the remedy.
    const bool has_owner = reason == RejectionReason::used_elsewhere;
    const auto colon = std::min(message.find(':'), message.size());
    const std::pair key(reason, has_owner ? message.substr(0, colon) : to_string(reason).data());
    remedies[key] = has_owner ? message.substr(colon) : remedy_for(reason);
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

std::string describe_none_kept(std::span<const Observation> images) {
  return fmt::format("none of the {} images can be used: {}", images.size(),
                     summarize_rejections(images));
}

void check_any_readable(const std::filesystem::path& where, std::span<const Observation> images) {
  const auto is_readable = [](const Observation& image) {
    return image.is_kept() || (image.rejection->reason != RejectionReason::unreadable &&
                               image.rejection->reason != RejectionReason::wrong_size);
  };
  if (std::any_of(images.begin(), images.end(), is_readable)) return;
  std::string message = fmt::format("none of its {} images can be used", images.size());
  if (!images.empty()) {
    message += fmt::format("; the first, {}: {}", images.front().name(),
                           images.front().rejection->message);
  }
  throw InputError(where, message);
}

void observe_pixels(const SourceImage& source, const FrontendOptions& options,
                    const std::optional<std::array<int, 2>>& imager_px, Observation& result,
                    const std::function<void(const cv::Mat&)>& detect) {
  RejectionReason reason = RejectionReason::unreadable;
  try {
    const cv::Mat image = source.read(options);
    result.size_px = {image.cols, image.rows};
    reason = RejectionReason::wrong_size;
    check_imager(source.file, result.size_px, imager_px);
    reason = RejectionReason::unreadable;
    detect(image);
  } catch (const InputError& error) {
    result.reject(reason, message_about(source.file, error));
  } catch (const std::exception& error) {
    result.reject(reason, "cannot be used: " + message_about(source.file, error));
  }
}

Observations observe_images(ImageSource& source, int threads,
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
    if (progress) progress(done, std::max(done, source.expected()));
  });
  result.warnings = source.warnings();
  return result;
}

}  // namespace vlp
