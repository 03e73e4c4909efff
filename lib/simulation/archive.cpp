// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include "simulation/archive.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <tuple>
#include <vector>

#include "captures/csv_writer.h"
#include "captures/parallel_for.h"
#include "geometry/angles.h"
#include "rig/input_error.h"
#include "simulation/scene.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> list_images_in_order(const fs::path& folder) {
  std::vector<fs::path> images;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const fs::path ending = entry.path().extension();
    if (ending == ".png" || ending == ".jpg") images.push_back(entry.path());
  }
  std::sort(images.begin(), images.end());
  return images;
}

/// Truncates an image to its header and a few hundred bytes.
void truncate_image(const fs::path& image) {
  constexpr std::uintmax_t kept_bytes = 600;
  if (fs::file_size(image) > kept_bytes) fs::resize_file(image, kept_bytes);
}

/// Names in archive.csv, in the order of ArchiveFault and ArchiveDamage.
constexpr std::array<std::string_view, 5> kFaultNames = {"", "leaning", "out-of-focus",
                                                         "moved-lamp", "cut-image"};
constexpr std::array<std::string_view, 5> kDamageNames = {"", "cut-images", "missing",
                                                          "wrong-board", "empty"};

/// Kinds of damage with their files or folders, in the order of their use.
constexpr std::array<std::pair<ArchiveDamage, const char*>, 8> kDamageTargets = {
    {{ArchiveDamage::cut_images, "boards"},
     {ArchiveDamage::missing, "lamps.yaml"},
     {ArchiveDamage::wrong_board, "board.yaml"},
     {ArchiveDamage::empty, "rotation"},
     {ArchiveDamage::cut_images, "rotation"},
     {ArchiveDamage::missing, "board.yaml"},
     {ArchiveDamage::empty, "boards"},
     {ArchiveDamage::missing, "rotation"}}};

/// Returns how many of the first n sessions are chosen if the fraction `fraction` of all is chosen.
/// Rounded to nearest, so that small archives have chosen sessions, too.
std::size_t count_chosen_sessions(std::size_t n, double fraction) {
  return static_cast<std::size_t>(std::floor(static_cast<double>(n) * fraction + 0.5));
}

/// Returns the number of the choice (from 0) that falls on session `index`; std::nullopt if it is
/// not chosen.
std::optional<std::size_t> find_chosen_index(std::size_t index, double fraction) {
  const std::size_t before = count_chosen_sessions(index, fraction);
  if (count_chosen_sessions(index + 1, fraction) == before) return std::nullopt;
  return before;
}

std::string format_numbered(const std::string& name, std::size_t number, std::size_t digits) {
  const std::string text = std::to_string(number);
  return name + std::string(digits - std::min(digits, text.size()), '0') + text;
}

/// Returns the mount tilted further by `tilt_rad` towards an azimuth of the image.
Mount tilt_mount(const Mount& mount, double tilt_rad, double azimuth_rad) {
  const Eigen::Vector3d zenith_in_camera = mount.level_from_camera.row(2);
  const Eigen::Vector3d axis(-std::sin(azimuth_rad), std::cos(azimuth_rad), 0);
  return {level_rotation_from_zenith(Eigen::AngleAxisd(tilt_rad, axis) * zenith_in_camera),
          mount.lever_arm_m};
}

void draw_camera(Scene& scene, const ArchiveVariation& variation, cv::RNG random) {
  const auto fraction = [&] { return random.uniform(-1.0, 1.0); };
  std::vector<double>& intrinsics = scene.camera.intrinsics;
  const double focal = 1 + variation.focal_fraction * fraction();
  for (std::size_t i = 0; i < 2; ++i) intrinsics[i] *= focal;
  for (std::size_t i = 2; i < 4; ++i) intrinsics[i] += variation.principal_point_px * fraction();
  for (std::size_t i = 4; i < intrinsics.size(); ++i) {
    intrinsics[i] *= 1 + variation.distortion_fraction * fraction();
  }
  const double tilt_rad = variation.tilt_rad * std::abs(fraction());
  scene.mount = tilt_mount(scene.mount, tilt_rad, std::numbers::pi * fraction());
  for (double& part : scene.mount.lever_arm_m) part += variation.lever_arm_m * fraction();
}

void draw_session(Scene& scene, const ArchiveVariation& variation, cv::RNG random) {
  scene.seed = draw_seed(random);
  for (SceneLamp& lamp : scene.lamps) {
    for (double& part : lamp.map_error_m) {
      part += variation.map_error_m * random.uniform(-1.0, 1.0);
    }
  }
}

void apply_archive_fault(ArchiveFault fault, Scene& scene) {
  if (fault == ArchiveFault::tilted) scene.mount = tilt_mount(scene.mount, rad_from_deg(4), 0);
  if (fault == ArchiveFault::out_of_focus) {
    scene.optics.blur_px = std::max(0.8, 1.5 * scene.optics.blur_px);
  }
  if (fault == ArchiveFault::moved_lamp) scene.lamps.front().map_error_m.x() += 0.03;
}

void check(const Scene& scene) {
  const auto has = [&](const std::string& folder) {
    return std::ranges::find(scene.sets, folder, &CaptureSet::folder) != scene.sets.end();
  };
  if (!scene.archive) throw std::invalid_argument("the scene has no key 'archive'");
  if (scene.lamps.empty() || !scene.board || !has("boards") || !has("rotation")) {
    throw std::invalid_argument(
        "an archive's scene has lamps, a board, and captures in folders boards and rotation");
  }
}

void write_table(const Scene& scene, std::size_t sessions, const fs::path& output) {
  CsvWriter table(output / "archive.csv", {"camera", "session", "fault", "damage", "damaged"});
  for (std::size_t i = 0; i < sessions; ++i) {
    const ArchiveSession session = make_archive_session(scene, i);
    table.write_csv_row({session.camera, session.session, archive_fault_name(session.fault),
                         damage_name(session.damage), session.damaged});
  }
  table.save_file();
}

/// Renders a session into a temporary folder, then moves it into place. Returns false if the
/// session exists already.
bool render_session(const ArchiveSession& session, const fs::path& output,
                    const std::string& provenance) {
  const fs::path place = output / session.camera / session.session;
  if (fs::exists(place)) return false;
  const fs::path unfinished = output / ".unfinished" / (session.camera + "-" + session.session);
  fs::create_directories(place.parent_path());
  fs::create_directories(unfinished);
  const std::string first_line = provenance.substr(0, provenance.find('\n'));
  render_scene(
      session.scene, unfinished,
      {{}, 1, first_line + ": " + session.camera + "/" + session.session + " of an archive\n"},
      [](const SimulationSummary&, std::size_t) {});
  damage_session(session, unfinished);
  fs::rename(unfinished, place);
  return true;
}

}  // namespace

std::string_view archive_fault_name(ArchiveFault fault) {
  return kFaultNames[static_cast<std::size_t>(fault)];
}

std::string_view damage_name(ArchiveDamage damage) {
  return kDamageNames[static_cast<std::size_t>(damage)];
}

void damage_session(const ArchiveSession& session, const fs::path& folder) {
  if (session.fault == ArchiveFault::cut_image) {
    const auto& sets = session.scene.sets;
    const auto lamps =
        std::find_if(sets.rbegin(), sets.rend(), [](const CaptureSet& set) { return !set.board; });
    truncate_image(list_images_in_order(folder / lamps->folder).front());
  }
  const fs::path target = folder / session.damaged;
  switch (session.damage) {
    case ArchiveDamage::cut_images:
      for (const fs::path& image : list_images_in_order(target)) truncate_image(image);
      break;
    case ArchiveDamage::missing:
      fs::remove_all(target);
      break;
    case ArchiveDamage::wrong_board: {
      Board board = session.scene.board->pattern;
      board.family = board.family == "tag36h11" ? "tag25h9" : "tag36h11";
      write_board(target, board);
      break;
    }
    case ArchiveDamage::empty:
      for (const auto& entry : fs::directory_iterator(target)) fs::remove_all(entry.path());
      break;
    case ArchiveDamage::none:
      break;
  }
}

ArchiveSession make_archive_session(const Scene& scene, std::size_t index) {
  const ArchiveVariation& variation = *scene.archive;
  const auto per_camera = static_cast<std::size_t>(variation.sessions_per_camera);
  const std::size_t camera = index / per_camera;
  ArchiveSession session{format_numbered("camera-", camera + 1, 5),
                         format_numbered("session-", index % per_camera + 1, 2),
                         scene,
                         ArchiveFault::none,
                         ArchiveDamage::none,
                         ""};
  session.scene.camera.id = session.camera;
  draw_camera(session.scene, variation, make_generator(scene.seed, "archive camera", camera));
  draw_session(session.scene, variation, make_generator(scene.seed, "archive session", index));
  const auto fault = find_chosen_index(index, variation.fault_fraction);
  if (const auto damage_target = find_chosen_index(index, variation.damage_fraction)) {
    std::tie(session.damage, session.damaged) =
        kDamageTargets[*damage_target % kDamageTargets.size()];
  } else if (fault) {
    session.fault = static_cast<ArchiveFault>(1 + *fault % (kFaultNames.size() - 1));
    apply_archive_fault(session.fault, session.scene);
  }
  return session;
}

SimulationSummary simulate_archive(const Scene& scene, std::size_t sessions, const fs::path& output,
                                   const SimulationOptions& options,
                                   const SimulationProgress& progress) {
  check(scene);
  claim_output_folder(output, options.provenance);
  write_table(scene, sessions, output);
  SimulationSummary summary;
  std::mutex counting;
  try {
    parallel_for(sessions, options.threads, [&](std::size_t index) {
      const bool rendered =
          render_session(make_archive_session(scene, index), output, options.provenance);
      const std::lock_guard lock(counting);
      ++(rendered ? summary.rendered : summary.existing);
      progress(summary, sessions);
    });
  } catch (const fs::filesystem_error& failure) {
    // [FILE-1]
    throw InputError(failure.path1(), "cannot be made: " + failure.code().message());
  }
  fs::remove(output / ".unfinished");  // empty, as all sessions have been moved
  return summary;
}

}  // namespace vlp
