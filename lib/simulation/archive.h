// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "simulation/scene.h"
#include "simulation/simulate.h"

namespace vlp {

/// Fault of a simulated unit whose captures are complete.
enum class ArchiveFault {
  none,
  tilted,        // camera tilt larger by 4 degrees
  out_of_focus,  // blur sigma times 1.5, at least 0.8 px
  moved_lamp,    // 30 mm added to the map error of the first lamp, along x
  cut_image      // the first image of the last lamp folder is truncated
};

/// Damage to the files of a session that makes its calibration impossible. ArchiveSession::damaged
/// names the affected folder or file.
enum class ArchiveDamage {
  none,
  cut_images,   // all images of a folder are truncated
  missing,      // a file or folder is missing
  wrong_board,  // board.yaml names another tag family
  empty         // a folder is empty
};

/// Session of a simulated archive, in the folder ARCHIVE/camera/session.
struct ArchiveSession {
  std::string camera, session;
  /// Scene with the lens, tilt, lever arm, map errors and fault of this session.
  Scene scene;
  ArchiveFault fault = ArchiveFault::none;
  ArchiveDamage damage = ArchiveDamage::none;
  /// Damaged file or folder, relative to the session folder; empty without damage.
  std::string damaged;
};

/// Returns the names used in archive.csv; empty for `none`.
std::string_view archive_fault_name(ArchiveFault fault);
std::string_view damage_name(ArchiveDamage damage);

/// Returns session `index` of an archive, counted from 0. It depends on scene and index only, so
/// that an archive can grow without changes to existing sessions.
///
/// Among the first n sessions, n damage_fraction are damaged and n fault_fraction are chosen for a
/// fault, to within one. A session chosen for both is damaged only. Kinds of fault and of damage
/// are used cyclically.
/// @pre the scene has an `archive`
ArchiveSession make_archive_session(const Scene& scene, std::size_t index);

/// Applies the cut_image fault and the damage of a session to its files in `folder`. A second call
/// has no further effect.
void damage_session(const ArchiveSession& session, const std::filesystem::path& folder);

/// Renders the first `sessions` sessions of an archive into `output`:
///   scene.yaml, archive.csv (camera, session, fault, damage, damaged)
///   CAMERA/SESSION/ with the files of render_scene(), then damaged
/// Sessions are written atomically. Existing sessions are kept (SimulationSummary counts sessions).
/// The bytes depend on the scene alone.
/// @throws as render_scene(); std::invalid_argument if the scene has no `archive`, no
/// lamps, no board, or lacks one of the folders `boards` and `rotation`
SimulationSummary simulate_archive(const Scene& scene, std::size_t sessions,
                                   const std::filesystem::path& output,
                                   const SimulationOptions& options,
                                   const SimulationProgress& progress);

}  // namespace vlp
