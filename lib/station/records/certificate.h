// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "station/records/run_record.h"

namespace vlp {

/// A figure of a calibration, and its standard uncertainty where the calibration states one.
struct CertifiedValue {
  std::string name, unit;
  double value;
  std::optional<double> standard_uncertainty;
};

/// Focal length, principal point, and what else there is: rotation centre, zenith, lever arm,
/// dispersion offset; each along x and y. The uncertainty is of the captures' scatter, that of the
/// zenith and the dispersion with the parts of the steps before. The board is taken as exact unless
/// it states print_sd, the lamp map unless it states sd_m, and the known points always.
std::vector<CertifiedValue> certified_values(const Calibration& calibration);

/// "12.346 +- 0.012 px": the value to the last digit of the expanded uncertainty U = 2 u, which has
/// two (JCGM 100:2008, 7.2.6); six digits, and that it is not stated, without one.
std::string words_of(const CertifiedValue& value);

/// Throws InputError for a run that has no certificate: of a golden unit, not judged, without a
/// calibration, or changed by hand.
void check_certifiable(const RunRecord& record);

/// The certificate of a unit's run, a page of HTML that needs nothing else: what ISO/IEC 17025:2017
/// (7.8.2, 7.8.4, 7.8.6) asks of one as far as a record has it. Unit, place, dates, number (the
/// run), procedure; values with U, k = 2; for each gate the statement of conformity with its
/// decision rule; the digests of all that it rests on. What no record has, who issues it and under
/// what conditions, is left to be filled in. Same record, same bytes. `calibration` is the
/// record's. Throws as check_certifiable().
std::string certificate(const RunRecord& record, const Calibration& calibration);

/// Writes it as certificate.html beside the files of the run, which are written where they are
/// missing (publish_run()); the file. Throws InputError.
std::filesystem::path write_certificate(const RunRecord& record,
                                        const std::filesystem::path& results);

}  // namespace vlp
