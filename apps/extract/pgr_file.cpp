#include "apps/extract/pgr_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "drivers/ladybug/ladybug_image.hpp"
#include "drivers/ladybug/pgr_source.hpp"

namespace hueline::apps {
namespace {

constexpr std::size_t kMagicBytes = 16, kHeadBytes = 3056, kIndexEntries = 512, kIndexStep = 50;
constexpr std::uint64_t kMostBytes = (std::uint64_t{2} << 30U) - 1;
constexpr std::uint32_t kVersion = 4;

void set_le32(std::span<std::byte> head, std::size_t at, std::uint64_t value) {
  for (std::size_t i = 0; i < 4; ++i) head[kMagicBytes + at + i] = static_cast<std::byte>(value >> 8U * i);
}

}  // namespace

Result<PgrFile> PgrFile::create(const std::filesystem::path& first) {
  if (!drivers::next_pgr_file(first).empty()) return PgrFile(first);
  return Error{ErrorCode::Invalid,
               fmt::format("{}: stream files of a Ladybug end at 2 GB, and the next number follows: give the first a "
                           "name such as drive-000000.pgr",
                           first.string())};
}

Status PgrFile::begin(std::span<const std::byte> first_image) {
  if (head_.empty()) {
    head_.resize(kMagicBytes + kHeadBytes);
    std::ranges::transform(drivers::kPgrMagic, head_.begin(), [](char c) { return static_cast<std::byte>(c); });
    set_le32(head_, 0x00, kVersion);
    if (const auto image = drivers::read_ladybug_image(first_image))
      for (const std::size_t serial : {0x08U, 0x0CU}) set_le32(head_, serial, image->serial);
  }
  auto file = storage::FileWriter::replace(next_);
  if (!file) return file.error();
  file_ = std::move(*file);
  index_.clear();
  images_ = 0;
  first_image_ = head_.size();
  return file_->write(head_);
}

Status PgrFile::write(std::span<const std::byte> packet) {
  const std::string_view text(reinterpret_cast<const char*>(packet.data()), packet.size());
  if (text.starts_with(drivers::kPgrGpsSummary)) {
    summary_.assign(packet.begin(), packet.end());
    return {};
  }
  if (text.starts_with(drivers::kPgrMagic) && packet.size() >= kMagicBytes + kHeadBytes) {
    if (Status closed = close(); !closed) return closed;
    head_.assign(packet.begin(), packet.end());
    return {};
  }
  const bool is_full =
      file_ && (file_->size() + packet.size() + summary_.size() > kMostBytes || images_ == kIndexEntries * kIndexStep);
  if (is_full)
    if (Status closed = close(); !closed) return closed;
  if (!file_)
    if (Status begun = begin(packet); !begun) return begun;
  if (images_++ % kIndexStep == 0) index_.push_back(file_->size());
  return file_->write(packet);
}

Status PgrFile::close() {
  if (!file_) return {};
  std::vector<std::byte> head(head_.begin(), head_.begin() + kMagicBytes + kHeadBytes);
  constexpr std::size_t kIndexEnd = 0xBEC;
  for (std::size_t i = 0; i < kIndexEntries; ++i) set_le32(head, kIndexEnd - 4 * i, i < index_.size() ? index_[i] : 0);
  set_le32(head, 0x74, 0);  // no padding behind images
  set_le32(head, 0x88, images_);
  set_le32(head, 0x8C, index_.size());
  set_le32(head, 0x90, kIndexStep);
  set_le32(head, 0x94, first_image_);
  set_le32(head, 0x98, summary_.empty() ? 0 : file_->size());
  set_le32(head, 0x9C, summary_.size());
  Status done = summary_.empty() ? Status() : file_->write(summary_);
  if (done.ok()) done = file_->overwrite(0, head);
  if (done.ok()) done = file_->close();
  file_.reset();
  summary_.clear();
  if (!done.ok()) return done;
  next_ = drivers::next_pgr_file(next_);
  ++files_;
  return {};
}

bool PgrFile::has_following() const {
  std::error_code error;
  return !next_.empty() && std::filesystem::is_regular_file(std::filesystem::symlink_status(next_, error));
}

Status PgrFile::remove_following() {
  for (; has_following(); next_ = drivers::next_pgr_file(next_))
    if (std::error_code error; !std::filesystem::remove(next_, error))
      return output_error("remove " + next_.string() + ", which an earlier and longer run has left", error.value());
  return {};
}

}  // namespace hueline::apps
