#pragma once

#include <functional>
#include <string>

#include "core/result.hpp"
#include "storage/las_format.hpp"

namespace hueline::apps {

/// Returns an error if a LAS, LAZ or COPC file with this header was not finished by the run that makes it: Unavailable
/// if the run goes on, else Truncated with what to do. The header says it (storage::kLasUnfinished), in whatever folder
/// the file lies.
Status check_run_of(const std::string& cloud, const storage::LasHeader& header);

/// Does the work of a command on a cloud, and says what check_run_of() says of it. Returns the exit status of `work`,
/// but kInputUnreadable in place of kDone and kNothingCame if the run that made the cloud did not finish it. A cloud
/// that has no point for that reason is not worked on.
int work_on_cloud(const std::string& cloud, const std::function<int()>& work);

}  // namespace hueline::apps
