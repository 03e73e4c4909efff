// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/detect_boards.h"

#include <algorithm>
#include <exception>
#include <mutex>
#include <utility>

#include "rig/input_error.h"

namespace vlp {
namespace {

struct ViewOutcome {
  std::filesystem::path file;
  std::optional<BoardView> view;
  std::string refused;
};

BoardView view_of(const BoardDetector& detector, const SourceImage& source, const BoardCache& cache,
                  double max_mpx) {
  if (cache.find) {
    if (auto known = cache.find(source)) return *known;
  }
  const cv::Mat image = source.read(max_mpx);
  BoardView view{source.file.filename().string(), {image.cols, image.rows}, detector.detect(image)};
  if (cache.keep) cache.keep(source, view);
  return view;
}

/// One bad image does not end a run, whatever is bad about it.
ViewOutcome outcome_of(const BoardDetector& detector, const SourceImage& source,
                       const BoardCache& cache, double max_mpx) {
  try {
    return {source.file, view_of(detector, source, cache, max_mpx), ""};
  } catch (const InputError& error) {
    return {source.file, {}, error.what()};
  } catch (const std::exception& error) {
    std::string reason = source.file.string() + ": cannot be used: " + error.what();
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    return {source.file, {}, reason};
  }
}

}  // namespace

FoundBoards detect_boards(const BoardDetector& detector, ImageSource& images, int threads,
                          const BoardCache& cache,
                          const std::function<void(std::size_t done)>& progress, double max_mpx) {
  std::vector<ViewOutcome> outcomes;
  std::mutex counting;
  std::size_t done = 0;
  for_each_image(images, threads, [&](const SourceImage& image) {
    ViewOutcome outcome = outcome_of(detector, image, cache, max_mpx);
    const std::lock_guard lock(counting);
    if (outcomes.size() <= image.index) outcomes.resize(image.index + 1);
    outcomes[image.index] = std::move(outcome);
    progress(++done);
  });
  FoundBoards result;
  for (ViewOutcome& outcome : outcomes) {
    result.images.push_back(outcome.file);
    if (outcome.view) {
      result.views.push_back(std::move(*outcome.view));
    } else {
      result.refused.push_back(std::move(outcome.refused));
    }
  }
  return result;
}

}  // namespace vlp
