#include "drivers/ladybug/pgr_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

#include "core/input_folder.hpp"
#include "drivers/ladybug/ladybug_image.hpp"
#include "drivers/little_endian.hpp"

namespace hueline::drivers {
namespace {

constexpr std::size_t kMagicBytes = 16, kHeadBytes = 3056;
constexpr std::uint64_t kMostBeforeImages = 16u << 20;
constexpr std::size_t kScanBytes = 1u << 20;

}  // namespace

void PgrSource::Config::visit(Keys& keys) {
  keys.text({"file", "",
             "The stream file (*.pgr). If its name ends in a number of six digits, the files with the next numbers "
             "follow."},
            file);
}

std::filesystem::path next_pgr_file(const std::filesystem::path& path) {
  constexpr std::size_t kDigits = 6;
  std::string stem = path.stem();
  if (stem.size() <= kDigits || stem[stem.size() - kDigits - 1] != '-' ||
      stem.find_first_not_of("0123456789", stem.size() - kDigits) != stem.npos)
    return {};
  const int number = std::stoi(stem.substr(stem.size() - kDigits)) + 1;
  stem.replace(stem.size() - kDigits, kDigits, fmt::format("{:06}", number));
  return path.parent_path() / (stem + path.extension().string());
}

Status PgrSource::open() {
  ended_.reset();
  pending_.clear();
  received_ = {};
  return open_file(config_.file);
}

Status PgrSource::open_file(const std::filesystem::path& path) {
  auto file = InputFile::open(path);
  if (!file) return file.error();
  const auto malformed = [&](std::string why) {
    return Error{ErrorCode::Malformed, fmt::format("{}: {}", path.string(), why)};
  };
  std::array<std::byte, kMagicBytes + kHeadBytes> bytes;
  if (file->size() < bytes.size()) return malformed("is too short for a stream of a Ladybug");
  if (Status status = file->read(0, bytes); !status) return status.error();
  if (std::string_view(reinterpret_cast<const char*>(bytes.data()), kMagicBytes) != kPgrMagic)
    return malformed(fmt::format("is no stream of a Ladybug: it does not begin with {}", kPgrMagic));
  const auto head = std::span(bytes).subspan(kMagicBytes);
  const std::uint64_t first = get_little<std::uint32_t>(head, 0x94), summary = get_little<std::uint32_t>(head, 0x98),
                      summary_size = get_little<std::uint32_t>(head, 0x9C);
  if (first < bytes.size() || first > std::min(file->size(), kMostBeforeImages))
    return malformed(fmt::format("its first image is said to begin at byte {} of {}", first, file->size()));
  const bool has_summary =
      summary_size > 0 && summary >= first && summary_size <= file->size() && summary <= file->size() - summary_size;
  expected_images_ = get_little<std::uint32_t>(head, 0x88);
  images_ = 0;
  summary_size_ = has_summary ? summary_size : 0;
  images_end_ = has_summary ? summary : file->size();
  file_ = std::move(*file);
  auto before = packet(0, first);
  if (!before) return before.error();
  pending_.push_back(std::move(*before));
  at_ = first;
  return {};
}

Result<Packet> PgrSource::packet(std::uint64_t offset, std::size_t size) {
  std::vector<std::byte> bytes(size);
  if (Status status = file_->read(offset, bytes); !status) return status.error();
  received_ += std::chrono::milliseconds(1);
  return Packet{kSystemSensor, PacketKind::Wire, false, 0, received_, Buffer::copy_of(bytes)};
}

Result<Packet> PgrSource::next(std::stop_token stop) {
  if (!file_) return Error{ErrorCode::Disconnected, "the file is not open"};
  while (pending_.empty()) {
    if (stop.stop_requested()) return Error{ErrorCode::Stopped, "stop was asked for"};
    if (ended_) return *ended_;
    if (Status status = skip_to_image(); !status) return status.error();
    if (!pending_.empty()) break;
    if (at_ >= images_end_) {
      end_file();
      continue;
    }
    std::array<std::byte, kLadybugFramingSize> framing;
    if (Status status = file_->read(at_, framing); !status) return status.error();
    const std::uint32_t size = *ladybug_image_size(framing);
    if (size > images_end_ - at_) {
      const Error cut{ErrorCode::Truncated, fmt::format("{}: the image at byte {} is cut off: {} of {} bytes",
                                                        file_->path().string(), at_, images_end_ - at_, size)};
      at_ = images_end_;
      return cut;
    }
    auto image = packet(at_, size);
    if (!image) return image.error();
    at_ += size;
    ++images_;
    return image;
  }
  Packet out = std::move(pending_.front());
  pending_.pop_front();
  return out;
}

/// Moves to the beginning of an image, or to the end of the images, and tells what is no image and no padding.
Status PgrSource::skip_to_image() {
  const std::uint64_t begin = at_;
  std::uint64_t strange = 0;
  std::vector<std::byte> bytes;
  bool is_found = false;
  while (at_ < images_end_ && !is_found) {
    bytes.resize(static_cast<std::size_t>(std::min<std::uint64_t>(kScanBytes, images_end_ - at_)));
    if (Status status = file_->read(at_, bytes); !status) return status.error();
    const std::size_t places = bytes.size() < kLadybugFramingSize ? 0 : bytes.size() - kLadybugFramingSize + 1;
    std::size_t skipped = 0;
    while (skipped < places && !ladybug_image_size(std::span(bytes).subspan(skipped))) ++skipped;
    is_found = skipped < places;
    const bool is_end = at_ + bytes.size() == images_end_;
    if (!is_found && is_end) skipped = bytes.size();
    strange +=
        static_cast<std::uint64_t>(std::count_if(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(skipped),
                                                 [](std::byte b) { return b != std::byte{0}; }));
    at_ += skipped;
  }
  if (strange > 0)
    pending_.push_back(
        fault_packet(received_, FaultKind::Malformed, at_ - begin,
                     fmt::format("{}: {} bytes at {} are no image", file_->path().string(), at_ - begin, begin)));
  return {};
}

void PgrSource::end_file() {
  if (images_ < expected_images_)
    pending_.push_back(fault_packet(
        received_, FaultKind::Lost, expected_images_ - images_,
        fmt::format("{}: its head says {} images, {} are there", file_->path().string(), expected_images_, images_)));
  expected_images_ = 0;
  if (summary_size_ > 0) {
    auto summary = packet(images_end_, static_cast<std::size_t>(summary_size_));
    summary_size_ = 0;
    if (summary) return pending_.push_back(std::move(*summary));
    ended_ = summary.error();
    return;
  }
  const auto following = next_pgr_file(file_->path());
  if (following.empty() || !holds(following.parent_path(), following.filename().string())) {
    ended_ = Error{ErrorCode::EndOfData, "the file has ended"};
  } else if (const Status opened = open_file(following); !opened) {
    ended_ = opened.error();
  }
}

}  // namespace hueline::drivers
