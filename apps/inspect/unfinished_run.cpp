#include "apps/inspect/unfinished_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "apps/exit_code.hpp"
#include "apps/log.hpp"
#include "core/input_folder.hpp"
#include "core/output_file.hpp"
#include "core/remote_store.hpp"
#include "storage/cloud_format.hpp"
#include "storage/las_reader.hpp"

namespace hueline::apps {

Status check_run_of(const std::string& cloud, const storage::LasHeader& header) {
  if (header.generating_software != storage::kLasUnfinished) return {};
  const std::filesystem::path path = cloud, folder = path.parent_path();
  if (!is_address(folder) && OutputFolder::is_held_by_another(folder))
    return Error{ErrorCode::Unavailable,
                 fmt::format("{}: a capture or replay is still writing it; this is what it has counted so far", cloud)};
  const std::string drive = folder.empty() ? "." : folder.string();
  const bool is_beside_recording =
      holds(folder, "drive.mcap") &&
      std::ranges::find(storage::kCloudFiles, path.filename().string()) != storage::kCloudFiles.end();
  return Error{
      ErrorCode::Truncated,
      fmt::format("{}: the run that was to make it did not finish it, and further points are missing; {}", cloud,
                  is_beside_recording ? fmt::format("`hueline replay {0} --out {0}` makes it whole", drive)
                                      : "replay the recording again to make it whole")};
}

int work_on_cloud(const std::string& cloud, const std::function<int()>& work) {
  const auto reader = storage::LasReader::open(cloud);
  const Status run = reader.ok() ? check_run_of(cloud, reader->header()) : Status{};
  const bool was_ended = !run.ok() && run.error().code == ErrorCode::Truncated;
  const bool has_no_point = reader.ok() && reader->header().point_count == 0;
  const int status = was_ended && has_no_point ? kNothingCame : work();
  if (run.ok() || (status != kDone && status != kNothingCame)) return status;
  if (was_ended)
    log_error(run.error().message);
  else
    log_warning("{}", run.error().message);
  return was_ended ? kInputUnreadable : status;
}

}  // namespace hueline::apps
