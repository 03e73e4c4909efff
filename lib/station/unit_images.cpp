// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Unit: the images of a step as they come and go.
#include <tuple>
#include <utility>

#include "detection/images_in_parallel.h"
#include "station/unit.h"

namespace vlp {

namespace fs = std::filesystem;

void Unit::add(StationStep step, const std::vector<fs::path>& files, bool more_to_come) {
  UnitStep& state = at(step);
  if (files.empty()) return;
  state.folder = files.front().parent_path();
  if (!calibration_before(step)) {
    state.waiting.insert(state.waiting.end(), files.begin(), files.end());
    return;
  }
  look(step, files);
  if (!more_to_come) count_refusals(step);
}

/// In a row, of all that came together.
void Unit::count_refusals(StationStep step) {
  UnitStep& state = at(step);
  const int refused = std::exchange(state.refused_together, 0);
  const bool used = std::exchange(state.used_together, false);
  state.refused_in_a_row = used ? 0 : state.refused_in_a_row + refused;
}

void Unit::look(StationStep step, const std::vector<fs::path>& files) {
  std::vector<UnitImage> images(files.size());
  std::optional<LampDetector> lamps;
  if (step != StationStep::boards) {
    lamps.emplace(config_.lamps, detector_camera(*calibration_before(step)));
  }
  images_in_parallel(files.size(), threads_, [&](std::size_t i) {
    images[i] = lamps ? look_at_lamps(files[i], config_, *lamps)
                      : look_at_board(files[i], config_, *boards_);
  });
  for (UnitImage& image : images) {
    const std::string owner = owner_ && !image.sha256.empty() ? owner_(image.sha256) : "";
    if (!owner.empty()) image.refused = "already of " + owner;
    at(step).last = image.file.filename().string();
    take(step, std::move(image));
  }
}

void Unit::take(StationStep step, UnitImage image) {
  UnitStep& state = at(step);
  const std::string name = image.file.filename().string();
  drop(step, name);  // it was overwritten
  if (image.refused.empty()) {
    std::tie(image.superfluous, image.refused) = superfluity(step, image);
  }
  const bool used = image.refused.empty();
  const bool fault = !used && image.superfluous == Superfluous::no && !state.done();
  state.refused_together += fault ? 1 : 0;
  state.used_together = state.used_together || used;
  state.images.emplace(name, std::move(image));
  if (!used) return;
  state.result.reset();
  forget_after(step);
}

/// Whether and why a good image is not needed.
std::pair<Superfluous, std::string> Unit::superfluity(StationStep step,
                                                      const UnitImage& image) const {
  for (const UnitStep& any : steps_) {
    for (const auto& [name, other] : any.images) {
      if (!other.refused.empty() || other.sha256 != image.sha256) continue;
      return {Superfluous::same_pose, "same image as " + name};
    }
  }
  const double near_px = config_.refuse.same_pose_share * config_.type.imager_px[0];
  for (const auto& [name, other] : this->step(step).images) {
    if (!other.refused.empty()) continue;
    const bool same =
        step == StationStep::boards
            ? same_pose(image.view->seen, other.view->seen, near_px)
            : step == StationStep::rotation && same_lamps(image.lamps, other.lamps, near_px);
    if (same) return {Superfluous::same_pose, "same pose as " + name};
  }
  if (!this->step(step).done()) return {Superfluous::no, ""};
  return {Superfluous::enough, "not needed: the step has enough"};
}

/// Takes an image out of its step, and with it what rests on it; those that it stood in the way of
/// get their turn.
void Unit::drop(StationStep step, const std::string& name) {
  UnitStep& state = at(step);
  const auto image = state.images.find(name);
  if (image == state.images.end()) return;
  const bool used = image->second.refused.empty();
  state.images.erase(image);
  if (!used) return;
  state.result.reset();
  forget_after(step);
  std::vector<UnitImage> again;
  for (const auto& [other, known] : state.images) {
    if (known.superfluous != Superfluous::no) again.push_back(known);
  }
  std::erase_if(state.images,
                [](const auto& known) { return known.second.superfluous != Superfluous::no; });
  for (UnitImage& known : again) {
    known.refused.clear();
    known.superfluous = Superfluous::no;
    take(step, std::move(known));
  }
}

void Unit::remove(StationStep step, const std::string& name) {
  UnitStep& state = at(step);
  std::erase_if(state.waiting, [&](const fs::path& file) { return file.filename() == name; });
  if (state.images.contains(name)) state.refused_in_a_row = 0;
  drop(step, name);
}

void Unit::discard(StationStep step, const std::string& name) {
  UnitStep& state = at(step);
  const auto image = state.images.find(name);
  if (image == state.images.end() || image->second.refused.empty()) return;
  state.refused_in_a_row = 0;
  if (image->second.superfluous != Superfluous::no) {
    state.images.erase(image);
  } else {
    image->second.discarded = true;
  }
}

/// What rests on a step is looked at anew with what will come of it.
void Unit::forget_after(StationStep step) {
  for (const StationStep later : kStationSteps) {
    if (later <= step) continue;
    UnitStep& state = at(later);
    for (const auto& [name, image] : state.images) {
      if (!image.discarded) state.waiting.push_back(image.file);
    }
    std::erase_if(state.images, [](const auto& image) { return !image.second.discarded; });
    state.result.reset();
    state.enough = false;
  }
}

}  // namespace vlp
