// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "simulation/scene.h"
#include "simulation/simulate.h"

namespace vlp {

/// What is wrong with a unit whose captures are whole.
enum class ArchiveFault {
  none,
  leaning,       // by 4 degrees more
  out_of_focus,  // half as much blur again, 0.8 px at least
  moved_lamp,    // the first lamp is 30 mm from where the map has it
  cut_image      // one image of the last folder of lamps ends early
};

/// What is wrong with the captures, so that they cannot give a calibration. The target is a folder
/// or file of the session.
enum class ArchiveDamage {
  none,
  cut_images,   // all images of a folder end early
  missing,      // a file or folder
  wrong_board,  // board.yaml tells of another family of tags
  empty         // a folder
};

/// One session of a simulated archive: ARCHIVE/camera/session.
struct ArchiveSession {
  std::string camera, session;
  /// The scene with the lens, the tilt, the lever arm, the lamp map and the fault of this session.
  Scene scene;
  ArchiveFault fault = ArchiveFault::none;
  ArchiveDamage damage = ArchiveDamage::none;
  std::string damaged;
};

std::string_view name_of(ArchiveFault fault);
std::string_view name_of(ArchiveDamage damage);

/// Session `index`, counted from 0; it depends on the scene and the index alone, so that an archive
/// grows without a change to what is there. Of the first n sessions n damage_share are damaged and
/// n fault_share have a fault, to less than one; damaged ones have no fault. Kinds take turns.
/// Precondition: the scene has an `archive`.
ArchiveSession archive_session(const Scene& scene, std::size_t index);

/// Damages a session's files. Done twice it is as done once.
void damage(const ArchiveSession& session, const std::filesystem::path& folder);

/// Renders so many sessions into `output`:
///   scene.yaml, archive.csv (camera, session, fault, damage, damaged)
///   CAMERA/SESSION/ with the files of simulate(), then damaged
/// A session appears whole; those that are there are kept (SimulationSummary counts sessions).
/// Bytes depend on the scene alone. Throws as simulate() does, and std::invalid_argument: a scene
/// without `archive`, lamps, or a board, or without the folders `boards` and `rotation`.
SimulationSummary simulate_archive(const Scene& scene, std::size_t sessions,
                                   const std::filesystem::path& output,
                                   const SimulationOptions& options,
                                   const SimulationProgress& progress);

}  // namespace vlp
