#include "drivers/trajectory/double_records.hpp"

#include <algorithm>

#include "drivers/stream/message_form.hpp"

namespace hueline::drivers {

Result<std::optional<std::vector<double>>> DoubleRecords::next() {
  constexpr std::uint64_t kRecordsAtOnce = 512;
  const std::size_t bytes = doubles_ * sizeof(double);
  if (at_ + bytes > block_.size()) {
    const std::uint64_t left = (file_.size() - offset_) / bytes;
    block_.resize(static_cast<std::size_t>(std::min(left, kRecordsAtOnce)) * bytes);
    if (block_.empty()) return std::optional<std::vector<double>>();
    if (Status read = file_.read(offset_, block_); !read.ok()) return read.error();
    offset_ += block_.size();
    at_ = 0;
  }
  std::vector<double> out(doubles_);
  for (std::size_t i = 0; i < doubles_; ++i) out[i] = stream_field<double>(block_, at_ + i * sizeof(double));
  at_ += bytes;
  return std::optional(std::move(out));
}

}  // namespace hueline::drivers
