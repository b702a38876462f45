#include "drivers/trajectory/sbet_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace hueline::drivers {
namespace {

constexpr double kAccuracyHolds_s = 2;
constexpr std::size_t kHeadBytes = 160;  // a record of an SBET, or two of an SMRMSG

bool is_text(std::byte byte) {
  const auto code = std::to_integer<unsigned>(byte);
  return (code >= 0x20 && code < 0x7F) || code == '\t' || code == '\n' || code == '\r';
}

}  // namespace

Result<SbetFile> SbetFile::open(const std::string& sbet, const std::string& smrmsg) {
  auto file = InputFile::open(sbet), again = InputFile::open(sbet);
  if (!file.ok()) return file.error();
  if (!again.ok()) return again.error();
  SbetFile out(DoubleRecords(std::move(*file), kSbetDoubles));
  std::vector<std::byte> head(static_cast<std::size_t>(std::min<std::uint64_t>(again->size(), kHeadBytes)));
  if (Status read = again->read(0, head); !read.ok()) return read.error();
  if (!head.empty() && std::all_of(head.begin(), head.end(), is_text))
    return Error{ErrorCode::Malformed, sbet +
                                           ": is a text; a trajectory is read as SBET: export it in that form (17 "
                                           "doubles a record, little endian)"};
  DoubleRecords look(std::move(*again), kSbetDoubles);
  const auto first = look.next();
  if (!first.ok()) return first.error();
  const std::string why = !*first ? std::string("less than one record") : impossible_sbet(**first);
  if (!why.empty() && is_smrmsg(head))
    return Error{
        ErrorCode::Malformed,
        sbet +
            ": holds the accuracies of a trajectory (SMRMSG), and no places: give the SBET beside it, and this "
            "file for its sigmas"};
  if (!why.empty())
    return Error{ErrorCode::Malformed,
                 fmt::format("{}: begins with {}, so it is no SBET: 17 doubles a record, little endian, beginning with "
                             "the second of the GPS week, latitude and longitude in radians",
                             sbet, why)};
  out.counts_.bytes_at_end = look.rest();
  if (smrmsg.empty()) return out;
  auto accuracies = SmrmsgFile::open(smrmsg);
  if (!accuracies.ok()) return accuracies.error();
  out.accuracies_.emplace(std::move(*accuracies));
  if (Status read = out.read_accuracy(); !read.ok()) return read.error();
  out.before_ = out.after_;
  if (Status read = out.read_accuracy(); !read.ok()) return read.error();
  return out;
}

/// Reads the next record of the SMRMSG into after_; empty at its end.
Status SbetFile::read_accuracy() {
  auto read = accuracies_->next();
  if (!read.ok()) return read.error();
  after_ = *read;
  counts_.accuracies = accuracies_->records();
  counts_.impossible_accuracies = accuracies_->impossible();
  counts_.accuracy_bytes_at_end = accuracies_->bytes_at_end();
  return {};
}

Status SbetFile::take_accuracy(SbetRecord& record) {
  while (after_ && after_->second <= record.second + 1e-4) {
    before_ = after_;
    if (Status read = read_accuracy(); !read.ok()) return read;
  }
  const auto away = [&](const std::optional<SmrmsgFile::Record>& one) {
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
