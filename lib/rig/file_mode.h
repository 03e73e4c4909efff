// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/stat.h>

namespace vlp {

/// Sets the permissions (read, write, execute), owner and group of an open file to those of the
/// file that it replaces; owner and group as far as this process may set them. If the group
/// differs, it gets no permissions. Returns false, and sets errno, if they cannot be read or set.
[[gnu::visibility("hidden")]] bool keep_mode_and_owner(int descriptor, const struct stat& former);

}  // namespace vlp
