// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/detect_boards.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "detection/images_in_parallel.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

struct ViewOutcome {
  std::optional<BoardView> view;
  std::string refused;
};

BoardView view_of(const BoardDetector& detector, const std::filesystem::path& file,
                  const BoardCache& cache, double max_mpx) {
  if (cache.find) {
    if (auto known = cache.find(file)) return *known;
  }
  const cv::Mat image = read_image(file, max_mpx);
  BoardView view{file.filename().string(), {image.cols, image.rows}, detector.detect(image)};
  if (cache.keep) cache.keep(file, view);
  return view;
}

/// One bad image does not end a run, whatever is bad about it.
ViewOutcome outcome_of(const BoardDetector& detector, const std::filesystem::path& file,
                       const BoardCache& cache, double max_mpx) {
  try {
    return {view_of(detector, file, cache, max_mpx), ""};
  } catch (const InputError& error) {
    return {{}, error.what()};
  } catch (const std::exception& error) {
    std::string reason = file.string() + ": cannot be used: " + error.what();
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    return {{}, reason};
  }
}

}  // namespace

FoundBoards detect_boards(const BoardDetector& detector,
                          const std::vector<std::filesystem::path>& images, int threads,
                          const BoardCache& cache,
                          const std::function<void(std::size_t done)>& progress, double max_mpx) {
  std::vector<ViewOutcome> outcomes(images.size());
  images_in_parallel(
      images.size(), threads,
      [&](std::size_t i) { outcomes[i] = outcome_of(detector, images[i], cache, max_mpx); },
      progress);
  FoundBoards result;
  for (ViewOutcome& outcome : outcomes) {
    if (outcome.view) {
      result.views.push_back(std::move(*outcome.view));
    } else {
      result.refused.push_back(std::move(outcome.refused));
    }
  }
  return result;
}

}  // namespace vlp
