#include "apps/fleet/upload.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <vector>

#include "apps/exit_code.hpp"
#include "apps/fleet/task.hpp"
#include "apps/log.hpp"
#include "apps/sha256.hpp"
#include "core/remote_store.hpp"

namespace hueline::apps {
namespace {

Status upload_task(const std::filesystem::path& folder, const TaskResult& result, const std::filesystem::path& to) {
  for (const auto& [file, product] : result.products)
    if (Status sent = write_remote(to / file, folder / file, product.sha256); !sent.ok()) return sent;
  // Behind what they describe.
  for (const char* file : {"log.txt", "result.json"}) {
    const auto sha256 = sha256_of(folder / file);
    if (!sha256.ok()) return sha256.error();
    if (Status sent = write_remote(to / file, folder / file, *sha256); !sent.ok()) return sent;
  }
  return {};
}

}  // namespace

int upload_results(const FleetPlan& plan, const std::string& address) {
  if (!is_address(address)) {
    log_error("{}: is no address of object storage, which is s3://BUCKET/KEY", address);
    return kWrongUse;
  }
  std::size_t sent = 0, open = 0, refused = 0;
  for (const FleetTask& task : plan.tasks) {
    const std::filesystem::path folder = results_of(plan, task);
    const auto result = finished_result(plan, task, Check::Sizes);
    if (!result) {
      ++open;
      continue;
    }
    if (const Status done = upload_task(folder, *result, std::filesystem::path(address) / task.name); !done.ok()) {
      log_error("{}; the results of {} stay in {}", done.error().message, task.name, folder.string());
      ++refused;
      continue;
    }
    ++sent;
    log_info("{} of {}: {}", sent, plan.tasks.size(), task.name);
  }
  fmt::print("{} of {} drives are at {}\n", sent, plan.tasks.size(), address);
  if (open > 0) fmt::print("{} are still to be done: `hueline fleet status {}`\n", open, plan.file.string());
  return refused > 0 ? kOutputRefused : open > 0 ? kStopped : kDone;
}

}  // namespace hueline::apps
