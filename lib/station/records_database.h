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

  /// Tables are there; from then on a connection that was lost is made again.
  bool ready = false;

  /// Errors name the database. The action may be done twice.
  template <typename Action>
  auto run(const Action& action) {
    try {
      try {
        return action();
      } catch (const soci::soci_error&) {
        if (!ready || sql.is_connected()) throw;
      }
      // A unit takes its minutes: meanwhile the server was started anew, or the network fell
      // asleep.
      sql.reconnect();
      return action();
    } catch (const InputError&) {
      throw;
    } catch (const std::exception& error) {
      std::string what = error.what();
      std::replace_if(
          what.begin(), what.end(), [](char c) { return c == '\n' || c == '\t'; }, ' ');
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
