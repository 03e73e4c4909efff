// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rig/input_error.h"

namespace vlp {

/// Error if records do not respond, refuse the connection or its user, or are locked. A later
/// attempt can succeed.
class RecordsOffline : public InputError {
 public:
  using InputError::InputError;
};
/// Error if records respond but refuse access: the setting `records` or the server has to be
/// corrected.
class RecordsRefused : public RecordsOffline {
 public:
  using RecordsOffline::RecordsOffline;
};

}  // namespace vlp
