#include "drivers/trajectory/smrmsg_file.hpp"

#include <algorithm>
#include <numbers>
#include <vector>

#include "core/input_file.hpp"
#include "drivers/stream/message_form.hpp"
#include "drivers/trajectory/sbet_record.hpp"

namespace hueline::drivers {
namespace {

constexpr std::size_t kAccuracyDoubles = 10;
constexpr double kRadPerArcMinute = std::numbers::pi / (180.0 * 60.0);

bool is_accuracy(const std::vector<double>& v) {
  return std::ranges::all_of(v, [](double value) { return value >= 0 && value < 1e6; });
}

}  // namespace

Result<SmrmsgFile> SmrmsgFile::open(const std::string& path) {
  auto file = InputFile::open(path);
  if (!file.ok()) return file.error();
  SmrmsgFile out(DoubleRecords(std::move(*file), kAccuracyDoubles));
  auto first = out.read();
  if (!first.ok()) return first.error();
  if (!*first)
    return Error{ErrorCode::Malformed, path + ": has no record of an SMRMSG, which has 10 doubles, little endian"};
  out.first_ = **first;
  return out;
}

Result<std::optional<SmrmsgFile::Record>> SmrmsgFile::read() {
  for (;;) {
    auto read = records_.next();
    if (!read.ok()) return read.error();
    if (!*read) return std::optional<Record>();
    const std::vector<double>& v = **read;
    if (!is_accuracy(v)) {
      if (!last_second_)
        return Error{ErrorCode::Malformed,
                     records_.path() +
                         ": begins with a negative or impossible number, so it is no SMRMSG: 10 doubles a record, "
                         "little endian, beginning with the second of the GPS week"};
      ++impossible_;
      continue;
    }
    const double second = continued_second(v[0], last_second_);
    last_second_ = second;
    return std::optional(Record{second,
                                {v[2], v[1], v[3], v[5], v[4], v[6], v[7] * kRadPerArcMinute, v[8] * kRadPerArcMinute,
                                 v[9] * kRadPerArcMinute}});
  }
}

Result<std::optional<SmrmsgFile::Record>> SmrmsgFile::next() {
  Result<std::optional<Record>> out = first_ ? Result<std::optional<Record>>(first_) : read();
  first_.reset();
  if (out.ok() && *out) ++count_;
  return out;
}

bool is_smrmsg(std::span<const std::byte> first_bytes) {
  constexpr std::size_t kRecord = kAccuracyDoubles * sizeof(double);
  constexpr double kSecondsOfWeek = 604800, kLongestStep_s = 60, kLargestSigma = 1e4;
  if (first_bytes.size() < 2 * kRecord) return false;
  std::array<double, 2> seconds{};
  for (std::size_t i = 0; i < seconds.size(); ++i) {
    seconds[i] = stream_field<double>(first_bytes, i * kRecord);
    bool is_any = false;
    for (std::size_t k = 1; k < kAccuracyDoubles; ++k) {
      const double sigma = stream_field<double>(first_bytes, i * kRecord + k * sizeof(double));
      if (!(sigma >= 0 && sigma < kLargestSigma)) return false;
      is_any = is_any || sigma > 1e-9;
    }
    if (!is_any) return false;
  }
  return seconds[0] >= 0 && seconds[0] < 2 * kSecondsOfWeek && seconds[1] > seconds[0] &&
         seconds[1] - seconds[0] <= kLongestStep_s;
}

}  // namespace hueline::drivers
