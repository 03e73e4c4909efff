// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "labelled_folders.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include "detection/image_file.h"
#include "progress.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

std::vector<Frame> labels_in(const fs::path& folder, const std::string& table, bool needed) {
  if (!table.empty()) return read_detections(folder / table);
  if (!needed) return {};
  for (const char* name : {"detections.csv", "true_detections.csv"}) {
    if (fs::exists(folder / name)) return read_detections(folder / name);
  }
  throw InputError(folder,
                   "has no detections.csv that says which lamp is where (image, lamp, u_px, v_px)");
}

}  // namespace

std::vector<LabelledFolder> labelled_folders(const std::vector<std::string>& folders,
                                             const std::string& table, bool needed) {
  std::vector<LabelledFolder> result;
  result.reserve(folders.size());
  for (const std::string& folder : folders) {
    result.push_back({folder, images_in(folder), labels_in(folder, table, needed)});
  }
  return result;
}

std::vector<std::vector<ImageLights>> lights_of(const LampDetector& detector,
                                                const std::vector<LabelledFolder>& folders,
                                                const std::optional<std::array<int, 2>>& imager_px,
                                                int threads) {
  std::size_t total = 0, before = 0;
  for (const LabelledFolder& folder : folders) total += folder.images.size();
  std::vector<std::vector<ImageLights>> all;
  all.reserve(folders.size());
  {
    Progress progress("images");
    for (const LabelledFolder& folder : folders) {
      all.push_back(
          detect_lights(detector, folder.images, imager_px, threads,
                        [&](std::size_t done) { progress.update(before + done, total); }));
      before += folder.images.size();
    }
  }
  std::size_t refused = 0;
  for (const auto& images : all) {
    for (const ImageLights& image : images) {
      if (image.refused.empty()) continue;
      spdlog::warn("{}; skipped", image.refused);
      ++refused;
    }
  }
  if (refused == total) {
    throw InputError(folders.front().folder,
                     fmt::format("none of the {} images can be used", total));
  }
  return all;
}

}  // namespace vlp
