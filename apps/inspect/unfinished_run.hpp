#pragma once

#include <functional>
#include <string>

#include "core/result.hpp"

namespace hueline::apps {

/// Returns an error if the capture or replay that makes a cloud has not come to its end: Truncated with what to do if
/// it was ended before, Unavailable if it goes on. A run writes the summary beside its cloud last, and removes an older
/// one when it begins the cloud. Of clouds that lie in no drive's folder nothing is known: ok.
Status check_run_of(const std::string& cloud);

/// Does the work of a command on a cloud, and says what check_run_of() says. Returns the exit status of `work`, but
/// kInputUnreadable in place of kDone and kNothingCame if the run that made the cloud was ended. A cloud that has no
/// point for that reason is not worked on.
int work_on_cloud(const std::string& cloud, const std::function<int()>& work);

}  // namespace hueline::apps
