#include "apps/simulate/simulated_disk.hpp"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace hueline::apps {
namespace {

class SimulatedFile final : public storage::DiskFile {
 public:
  SimulatedFile(sim::FaultyDisk& model, std::unique_ptr<storage::DiskFile> real)
      : model_(model), real_(std::move(real)) {}

  std::int64_t append(std::span<const iovec> pieces) override {
    std::uint64_t size = 0;
    for (const iovec& piece : pieces) size += piece.iov_len;
    const std::int64_t taken = model_.append(size);
    std::vector<iovec> rest(pieces.begin(), pieces.end());
    for (std::int64_t left = taken; left > 0;) {
      std::size_t count = 0;
      for (std::int64_t sum = 0; count < rest.size() && sum < left; ++count) {
        rest[count].iov_len = std::min(rest[count].iov_len, static_cast<std::size_t>(left - sum));
        sum += static_cast<std::int64_t>(rest[count].iov_len);
      }
      const std::int64_t written = real_->append(std::span(rest).first(count));
      if (written == -EINTR) continue;
      if (written <= 0) return written < 0 ? written : -EIO;
      left -= written;
      std::int64_t done = written;
      while (done > 0 && done >= static_cast<std::int64_t>(rest.front().iov_len)) {
        done -= static_cast<std::int64_t>(rest.front().iov_len);
        rest.erase(rest.begin());
      }
      if (done > 0)
        rest.front() = {static_cast<std::byte*>(rest.front().iov_base) + done,
                        rest.front().iov_len - static_cast<std::size_t>(done)};
    }
    return taken;
  }
  // Not supported: overwriting synced bytes could tear them at a power cut, and the model only knows files that grow.
  std::int64_t overwrite(std::uint64_t, std::span<const std::byte>) override { return -EOPNOTSUPP; }
  int sync() override { return model_.sync(); }
  int truncate(std::uint64_t size) override {
    const int answer = model_.truncate(size);
    return answer != 0 ? answer : real_->truncate(size);
  }
  int check_place() override { return real_->check_place(); }
  int descriptor() const override { return real_->descriptor(); }
  int close() override { return real_->close(); }

 private:
  sim::FaultyDisk& model_;
  std::unique_ptr<storage::DiskFile> real_;
};

}  // namespace

int SimulatedDisk::create(const std::filesystem::path& path, storage::IfExists if_exists,
                          std::unique_ptr<storage::DiskFile>& file) {
  std::unique_ptr<storage::DiskFile> real;
  const int answer = storage::Disk::kernel().create(path, if_exists, real);
  if (answer == 0) file = std::make_unique<SimulatedFile>(model_, std::move(real));
  return answer;
}

Status SimulatedDisk::leave_remains(const std::filesystem::path& path) const {
  const auto remains = model_.remains();
  std::error_code error;
  std::filesystem::resize_file(path, remains.size, error);
  if (error) return io_error("cut " + path.string(), error.value());
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  for (const auto& range : remains.zeros) {
    const std::vector<char> zeros(static_cast<std::size_t>(range.end - range.begin));
    file.seekp(static_cast<std::streamoff>(range.begin));
    file.write(zeros.data(), static_cast<std::streamsize>(zeros.size()));
  }
  file.close();
  if (!file) return io_error("overwrite " + path.string(), errno);
  return {};
}

}  // namespace hueline::apps
