// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/publish_run.h"

#include <array>
#include <cstdint>
#include <system_error>
#include <utility>

#include "rig/file.h"
#include "rig/input_error.h"
#include "station/records/unit_report.h"
#include "station/station_folders.h"

namespace vlp {

namespace fs = std::filesystem;

void check_results(const fs::path& results, const std::string& camera) {
  constexpr std::uintmax_t room_bytes = 8'000'000;
  check_room(results / camera, room_bytes);
}

const char* calibration_name(const RunRecord& record) {
  if (voided(record) != nullptr) return "voided-calibration.yaml";
  if (record.passed()) return "calibration.yaml";
  return record.invalid() ? "invalid-calibration.yaml" : "failed-calibration.yaml";
}

bool mark_files_voided(const RunRecord& record, const fs::path& results) {
  constexpr std::array names{std::pair("calibration.yaml", "voided-calibration.yaml"),
                             std::pair("failed-calibration.yaml", "voided-calibration.yaml"),
                             std::pair("invalid-calibration.yaml", "voided-calibration.yaml"),
                             std::pair("certificate.html", "voided-certificate.html"),
                             std::pair("report.html", "voided-report.html")};
  const fs::path folder = results / record.camera / record.run;
  bool is_any_renamed = false;
  for (const auto& [name, voided_name] : names) {
    std::error_code error;
    fs::rename(folder / name, folder / voided_name, error);
    is_any_renamed = is_any_renamed || !error;
    const bool is_missing =
        error == std::errc::no_such_file_or_directory || error == std::errc::not_a_directory;
    if (!error || is_missing) continue;
    throw InputError(folder / name, "cannot be renamed: " + error.message());
  }
  return is_any_renamed;
}

fs::path publish_run(const RunRecord& record, const std::vector<ReportPicture>& pictures,
                     const fs::path& results) {
  const fs::path folder = results / record.camera / record.run;
  make_folder(folder);
  fs::path calibration;
  if (!record.calibration.empty()) {
    calibration = folder / calibration_name(record);
    if (!fs::exists(calibration)) {
      write_file(calibration, record.calibration);
    } else if (read_text_file(calibration, 2 * record.calibration.size()) != record.calibration) {
      throw InputError(calibration, "is not what the record has: move it away");
    }
  }
  const fs::path report = folder / (voided(record) ? "voided-report.html" : "report.html");
  if (!fs::exists(report)) write_file(report, unit_report(record, calibration, pictures));
  return folder;
}

}  // namespace vlp
