#include "apps/object_storage.hpp"

#include <cstdlib>
#include <optional>
#include <string>

#include "apps/log.hpp"

namespace hueline::apps {
namespace {

std::optional<std::string> variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::nullopt : std::optional<std::string>(value);
}

}  // namespace

ObjectStorage::ObjectStorage() : store_(variable, [](const std::string& words) { log_warning("{}", words); }) {
  use_remote_store(&store_);
}

ObjectStorage::~ObjectStorage() {
  use_remote_store(nullptr);
  const object_store::S3Traffic traffic = store_.traffic();
  if (traffic.requests == 0) return;
  log_info("object storage: {:.1f} MB fetched, {:.1f} MB sent, {} requests{}",
           static_cast<double>(traffic.fetched_bytes) / 1e6, static_cast<double>(traffic.sent_bytes) / 1e6,
           traffic.requests,
           traffic.retries == 0 ? std::string() : fmt::format(", {} of them tried again", traffic.retries));
}

}  // namespace hueline::apps
