// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "station/records/run_record.h"

namespace vlp {

/// Value of a calibration, with its standard uncertainty if the calibration contains one.
struct CertifiedValue {
  std::string name, unit;
  double value;
  std::optional<double> standard_uncertainty;
};

/// Returns the values of a calibration for a certificate, with standard uncertainties if known. The
/// values are focal length, principal point, rotation center, zenith, lever arm and dispersion
/// offset. Each has two entries, along x and y. Focal length, principal point, rotation center
/// and dispersion offset are in px, the lever arm is in mm. The zenith is in degrees: 180/pi times
/// its point (x/z, y/z) in the camera.
///
/// The uncertainties are estimated from the scatter of the captures. Those of zenith and dispersion
/// include the contributions of the earlier steps. The board is assumed exact unless it has
/// print_sd, the lamp map unless it has sd_m. Known points are always assumed exact.
std::vector<CertifiedValue> list_certified_values(const Calibration& calibration);

/// Formats a value as "12.346 +- 0.012 px". The expanded uncertainty U = 2 u has two significant
/// digits (JCGM 100:2008, 7.2.6), and the value ends at the same digit. Without an uncertainty the
/// value has six digits and a note that none is stated.
std::string format_value_with_expanded_uncertainty(const CertifiedValue& value);

/// Checks that a run may have a certificate. Throws InputError for
/// - a run of a golden unit,
/// - a run that was not judged or has no calibration,
/// - a record that was edited manually.
void check_certifiable(const RunRecord& record);

/// Returns the certificate of a unit's run as a self-contained HTML page. Equal records give
/// identical bytes. `calibration` is the calibration of the record. Throws as
/// check_certifiable().
///
/// Contents, according to ISO/IEC 17025:2017 (7.8.2, 7.8.4, 7.8.6) as far as a record contains
/// them:
/// - unit, location, dates, number (the run), procedure,
/// - values with U (k = 2), and the correlations of their errors,
/// - for each gate the statement of conformity with its decision rule,
/// - digests of all inputs.
///
/// Issuer and conditions are not recorded; the page has blanks for them.
std::string make_certificate(const RunRecord& record, const Calibration& calibration);

/// Writes the certificate to certificate.html next to the files of the run, and returns its path.
/// Writes missing files of the run, too (publish_run_files()). Throws InputError.
std::filesystem::path write_certificate(const RunRecord& record,
                                        const std::filesystem::path& results);

}  // namespace vlp
