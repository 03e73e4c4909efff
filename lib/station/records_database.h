// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <soci/soci.h>

#include <algorithm>
#include <string>

#include "rig/input_error.h"
#include "station/records.h"

namespace vlp {

struct Records::Database {
  std::string where;
  soci::session sql;

  /// Errors name the database.
  template <typename Action>
  auto run(const Action& action) {
    try {
      return action();
    } catch (const InputError&) {
      throw;
    } catch (const std::exception& error) {
      std::string what = error.what();
      std::replace(what.begin(), what.end(), '\n', ' ');
      throw InputError(shown(), "the records: " + what);
    }
  }

  /// Password and user are nobody's business in a message.
  std::string shown() const {
    const auto at = where.find('@');
    return where.starts_with("postgresql://") && at != std::string::npos
               ? "postgresql://" + where.substr(at + 1)
               : where;
  }
};

}  // namespace vlp
