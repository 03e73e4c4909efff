// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/publish_run.h"

#include <fmt/core.h>

#include <cstdint>

#include "rig/file.h"
#include "rig/input_error.h"
#include "station/unit_report.h"

namespace vlp {

namespace fs = std::filesystem;

namespace {

void make_results_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw InputError(folder, "cannot be made: " + error.message());
}

}  // namespace

void check_results(const fs::path& results, const std::string& camera) {
  constexpr std::uintmax_t room_bytes = 8'000'000;
  constexpr double megabyte = 1e6;
  const fs::path folder = results / camera, probe = folder / ".writable";
  make_results_folder(folder);
  std::error_code error;
  const fs::space_info space = fs::space(folder, error);
  if (!error && space.available < room_bytes) {
    throw InputError(
        folder, fmt::format("has room for {:.1f} MB, the results of a run may need "
                            "{:.0f}: make room before the unit is begun",
                            double(space.available) / megabyte, double(room_bytes) / megabyte));
  }
  write_file(probe, "results can be written here\n");
  fs::remove(probe, error);
}

fs::path publish_run(const RunRecord& record, const std::vector<ReportPicture>& pictures,
                     const fs::path& results) {
  const fs::path folder = results / record.camera / record.run;
  make_results_folder(folder);
  fs::path calibration;
  if (!record.calibration.empty()) {
    calibration = folder / (record.passed()    ? "calibration.yaml"
                            : record.invalid() ? "invalid-calibration.yaml"
                                               : "failed-calibration.yaml");
    if (!fs::exists(calibration)) {
      write_file(calibration, record.calibration);
    } else if (read_text_file(calibration, 2 * record.calibration.size()) != record.calibration) {
      throw InputError(calibration, "is not what the record has: move it away");
    }
  }
  const fs::path report = folder / "report.html";
  if (!fs::exists(report)) write_file(report, unit_report(record, calibration, pictures));
  return folder;
}

}  // namespace vlp
