// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>

#include <filesystem>
#include <string>
#include <vector>

#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {

/// The station of datasets/station, content with fewer images, and a unit for it: 16 board views, 2
/// x 6 captures of the turn, 12 of the dispersion, 8 of the check; rendered in 1.5 s of CPU time.
class SmallStation : public testing::Test {
 protected:
  SmallStation();

  TemporaryFolder folder;
  std::filesystem::path station = folder / "station/station.yaml";

  /// Replaces the first `from` in a file of the station's folder, or in the unit's scene.
  void change(const std::string& file, const std::string& from, const std::string& to) const;
  /// Renders the unit, or some folders of it, into unit/.
  void render(const std::string& only = "boards,rotation,dispersion,check") const;

  /// Four of the boards only: too few, for a run that is soon INVALID.
  void render_four_boards() const {
    change("scene.yaml", "count: 16", "count: 4");
    render("boards");
  }

  std::string run(const std::string& camera, const std::string& options) const {
    return "vlp-station run --station " + station.string() + " --camera-id " + camera + " " +
           options;
  }
  std::string batch(const std::string& camera = "0001") const {
    return run(camera, "--batch " + (folder / "unit").string());
  }
  ProgramResult records(const std::string& command) const {
    return run_program("vlp-station " + command + " --station " + station.string());
  }
  /// Returns the folder where the images of a camera arrive.
  std::filesystem::path captures(const std::string& camera) const {
    return folder / "station/captures" / camera;
  }
  /// The names of the files in the station's spool.
  std::vector<std::string> spooled_files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder / "station/spool")) {
      names.push_back(entry.path().filename().string());
    }
    return names;
  }
  /// The images of the unit as another camera would take them: the same pictures, other files.
  void take_again() const;
  /// The images of a step of the unit, by name.
  std::vector<std::filesystem::path> images(const std::string& step) const;
  /// captures.csv of a step of the unit, with a small inclination of each capture.
  std::string with_inclinations(const std::string& step) const;
  /// An image into a step's folder as a capture tool would do it: under another name first.
  void drop(const std::filesystem::path& image, const std::filesystem::path& step) const;
  /// The folders of a camera with the tables, as the fixture of a station writes them.
  void prepare(const std::string& camera) const;
  /// All images of the unit, in the order of the steps.
  void drop_all(const std::string& camera) const;
  /// The calibration of a camera without its id and the digests of its images.
  std::string comparable_calibration(const std::string& camera) const;
  /// The one file of this name below the results of a camera; its content, empty without one.
  std::string result(const std::string& camera, const std::string& name) const;
};

}  // namespace vlp
