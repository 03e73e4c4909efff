// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/publish_run.h"

#include "rig/file.h"
#include "rig/input_error.h"
#include "station/unit_report.h"

namespace vlp {

namespace fs = std::filesystem;

fs::path publish_run(const RunRecord& record, const std::vector<ReportPicture>& pictures,
                     const fs::path& results) {
  const fs::path folder = results / record.camera / record.run;
  if (fs::exists(folder / "report.html")) return folder;
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw InputError(folder, "cannot be made: " + error.message());
  fs::path calibration;
  if (!record.calibration.empty()) {
    calibration = folder / (record.passed() ? "calibration.yaml" : "failed-calibration.yaml");
    write_file(calibration, record.calibration);
  }
  write_file(folder / "report.html", unit_report(record, calibration, pictures));
  return folder;
}

void finish_run(const RunRecord& record, const std::vector<ReportPicture>& pictures,
                Records& records, const fs::path& results) {
  records.keep(record);
  publish_run(record, pictures, results);
}

}  // namespace vlp
