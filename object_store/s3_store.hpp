#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/mutex.hpp"
#include "core/remote_store.hpp"
#include "object_store/s3_client.hpp"

namespace hueline::object_store {

/// Object storage by the protocol S3, of AWS and of others, as files (core/remote_store.hpp). What is
/// configured (S3Access) is read when the first address is opened. An object is read in blocks (BlockReader) with the
/// ETag that it had when it was opened: one that is replaced meanwhile is an error, and never a mixture. Thread-safe.
class S3Store final : public RemoteStore {
 public:
  /// `tell` gets a sentence when something fails and is asked for again; several threads may call it.
  S3Store(S3Access::Environment environment, std::function<void(const std::string&)> tell);
  ~S3Store() override;

  Result<std::shared_ptr<RemoteFile>> open(const std::string& address) override;
  Result<std::vector<std::string>> list(const std::string& folder) override;
  Status write(const std::string& address, const std::filesystem::path& file, const std::string& sha256) override;

  /// What was asked so far.
  S3Traffic traffic();

 private:
  Result<S3Client*> client();

  const S3Access::Environment environment_;
  const std::function<void(const std::string&)> tell_;
  Mutex mutex_;
  std::unique_ptr<S3Client> client_ HUELINE_GUARDED_BY(mutex_);
};

}  // namespace hueline::object_store
