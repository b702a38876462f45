#include "drivers/trajectory/sbet_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "drivers/stream/message_form.hpp"

namespace hueline::drivers {
namespace {

constexpr std::size_t kAccuracyDoubles = 10, kRecordsAtOnce = 512;
constexpr double kAccuracyHolds_s = 2;
constexpr double kRadPerArcMinute = std::numbers::pi / (180.0 * 60.0);

bool is_text(std::byte byte) {
  const auto code = std::to_integer<unsigned>(byte);
  return (code >= 0x20 && code < 0x7F) || code == '\t' || code == '\n' || code == '\r';
}

}  // namespace

Result<std::optional<std::vector<double>>> SbetFile::Records::next() {
  const std::size_t bytes = doubles_ * sizeof(double);
  if (at_ + bytes > block_.size()) {
    const std::uint64_t left = (file_.size() - offset_) / bytes;
    block_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(left, kRecordsAtOnce)) * bytes);
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

Result<SbetFile> SbetFile::open(const std::string& sbet, const std::string& smrmsg) {
  auto file = InputFile::open(sbet), again = InputFile::open(sbet);
  if (!file.ok()) return file.error();
  if (!again.ok()) return again.error();
  SbetFile out(Records(std::move(*file), kSbetDoubles));
  std::vector<std::byte> head(static_cast<std::size_t>(std::min<std::uint64_t>(again->size(), kSbetBytes)));
  if (Status read = again->read(0, head); !read.ok()) return read.error();
  if (!head.empty() && std::all_of(head.begin(), head.end(), is_text))
    return Error{ErrorCode::Malformed, sbet +
                                           ": is a text; a trajectory is read as SBET: export it in that form (17 "
                                           "doubles a record, little endian)"};
  Records look(std::move(*again), kSbetDoubles);
  const auto first = look.next();
  if (!first.ok()) return first.error();
  const std::string why = !*first ? std::string("less than one record") : impossible_sbet(**first);
  if (!why.empty())
    return Error{ErrorCode::Malformed,
                 fmt::format("{}: begins with {}, so it is no SBET: 17 doubles a record, little endian, beginning with "
                             "the second of the GPS week, latitude and longitude in radians",
                             sbet, why)};
  out.counts_.bytes_at_end = look.rest();
  if (smrmsg.empty()) return out;
  auto accuracy = InputFile::open(smrmsg);
  if (!accuracy.ok()) return accuracy.error();
  out.accuracies_.emplace(std::move(*accuracy), kAccuracyDoubles);
  out.counts_.accuracy_bytes_at_end = out.accuracies_->rest();
  if (Status read = out.read_accuracy(); !read.ok()) return read.error();
  out.before_ = out.after_;
  if (Status read = out.read_accuracy(); !read.ok()) return read.error();
  if (!out.before_)
    return Error{ErrorCode::Malformed, smrmsg + ": has no record of an SMRMSG, which has 10 doubles, little endian"};
  return out;
}

/// Reads the next record of the SMRMSG into after_; empty at its end.
Status SbetFile::read_accuracy() {
  after_.reset();
  for (;;) {
    auto read = accuracies_->next();
    if (!read.ok()) return read.error();
    if (!*read) return {};
    const std::vector<double>& v = **read;
    if (!std::all_of(v.begin(), v.end(), [](double value) { return value >= 0 && value < 1e6; })) {
      if (!last_accuracy_)
        return Error{ErrorCode::Malformed,
                     accuracies_->path() +
                         ": begins with a negative or impossible number, so it is no SMRMSG: 10 doubles a record, "
                         "little endian, beginning with the second of the GPS week"};
      ++counts_.impossible_accuracies;
      continue;
    }
    ++counts_.accuracies;
    const double second = continued_second(v[0], last_accuracy_);
    last_accuracy_ = second;
    after_ = Accuracy{second,
                      {v[2], v[1], v[3], v[5], v[4], v[6], v[7] * kRadPerArcMinute, v[8] * kRadPerArcMinute,
                       v[9] * kRadPerArcMinute}};
    return {};
  }
}

Status SbetFile::take_accuracy(SbetRecord& record) {
  while (after_ && after_->second <= record.second + 1e-4) {
    before_ = after_;
    if (Status read = read_accuracy(); !read.ok()) return read;
  }
  const auto away = [&](const std::optional<Accuracy>& one) {
    return one ? std::abs(one->second - record.second) : 2 * kAccuracyHolds_s;
  };
  const auto& nearest = away(after_) < away(before_) ? after_ : before_;
  if (away(nearest) <= kAccuracyHolds_s) record.sigma = nearest->sigma;
  return {};
}

Result<SbetRecord> SbetFile::next() {
  for (;;) {
    auto read = poses_.next();
    if (!read.ok()) return read.error();
    if (!*read) return Error{ErrorCode::EndOfData, poses_.path() + ": end"};
    const std::vector<double>& v = **read;
    if (!impossible_sbet(v).empty()) {
      ++counts_.impossible;
      continue;
    }
    SbetRecord record = sbet_record(v);
    record.second = continued_second(record.second, last_second_);
    if (last_second_ && record.second <= *last_second_) {
      ++counts_.out_of_order;
      continue;
    }
    last_second_ = record.second;
    if (accuracies_)
      if (Status taken = take_accuracy(record); !taken.ok()) return taken.error();
    ++counts_.records;
    return record;
  }
}

}  // namespace hueline::drivers
