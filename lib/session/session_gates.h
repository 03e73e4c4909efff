// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "evaluation/gate.h"
#include "session/session.h"
#include "session/session_folder.h"

namespace vlp {

/// Returns the metrics of the procedure, which its gates can limit.
std::vector<MetricKind> list_session_metrics();

/// Returns the gates of a session: those of the lens, if it is estimated, and those of its file.
/// @throws InputError if the file of gates is invalid
std::vector<Gate> read_session_gates(const SessionFolder& session, const SessionOptions& options);

/// Returns the gates of the metrics of a step.
std::vector<Gate> select_step_gates(const std::vector<Gate>& gates, std::string_view step);

/// Returns gates that every correct session passes, for the metrics that a step has: they notice a
/// wrong row time, a rotation or a lens of another camera, and errors that contradict the reported
/// standard deviations. RMS errors below 5 mm do not, as reference points are measured no better.
std::vector<Gate> make_step_gates(const std::vector<Metric>& metrics);

}  // namespace vlp
