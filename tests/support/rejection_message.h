// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>

#include <string>

#include "rig/input_error.h"

namespace vlp {

/// Returns the message of the exception that `read` throws; empty if it does not throw.
template <typename Error = InputError, typename Read>
std::string rejection_message(const Read& read) {
  try {
    read();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace vlp
