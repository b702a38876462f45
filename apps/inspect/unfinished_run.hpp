#pragma once

#include <functional>
#include <string>

#include "core/result.hpp"

namespace hueline::apps {

/// Returns an error if a LAS, LAZ or COPC file was not finished by the run that makes it: Unavailable if the run goes
/// on, else Truncated with what to do. The file says it itself (storage::kLasUnfinished), in whatever folder it lies.
/// Of files of other kinds nothing is known: ok.
Status check_run_of(const std::string& cloud);

/// Does the work of a command on a cloud, and says what check_run_of() says. Returns the exit status of `work`, but
/// kInputUnreadable in place of kDone and kNothingCame if the run that made the cloud did not finish it. A cloud that
/// has no point for that reason is not worked on.
int work_on_cloud(const std::string& cloud, const std::function<int()>& work);

}  // namespace hueline::apps
