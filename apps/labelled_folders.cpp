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

/// The order is the order of the images.
void report_refused(ImageLights& image, const std::array<int, 2>& imager_px) {
  const bool any_size = imager_px[0] == 0;
  if (image.refused.empty() && !any_size && image.size != cv::Size(imager_px[0], imager_px[1])) {
    image.refused =
        fmt::format("{}: is {} x {}, the calibration's camera has {} x {} px", image.file.string(),
                    image.size.width, image.size.height, imager_px[0], imager_px[1]);
    image.lights.clear();
  }
  if (!image.refused.empty()) spdlog::warn("{}; skipped", image.refused);
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
                                                const std::array<int, 2>& imager_px, int threads) {
  std::size_t total = 0, before = 0;
  for (const LabelledFolder& folder : folders) total += folder.images.size();
  std::vector<std::vector<ImageLights>> all;
  all.reserve(folders.size());
  {
    Progress progress("images");
    for (const LabelledFolder& folder : folders) {
      all.push_back(detect_lights(detector, folder.images, threads, [&](std::size_t done) {
        progress.update(before + done, total);
      }));
      before += folder.images.size();
    }
  }
  for (auto& images : all) {
    for (ImageLights& image : images) report_refused(image, imager_px);
  }
  return all;
}

}  // namespace vlp
