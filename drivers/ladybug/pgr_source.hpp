#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "core/input_file.hpp"
#include "core/keys.hpp"
#include "core/packet.hpp"

namespace hueline::drivers {

/// The first 16 bytes of a stream file of a Ladybug.
constexpr std::string_view kPgrMagic = "PGRLADYBUGSTREAM";
/// What a GPS summary begins with.
constexpr std::string_view kPgrGpsSummary = "GPSSUMMARY";

/// Reads the stream files of a Ladybug (*.pgr), which LadybugCapPro and the maker's library write. After 16 bytes of
/// kPgrMagic comes a head of 3056 bytes, little endian (offsets from its beginning):
///
///     0x08, 0x0C  serial numbers of base and head       0x88  number of images
///     0x74  size of the padding                         0x8C  number of index entries
///     0x78  data format                                 0x90  images from one entry to the next
///     0x7C  resolution                                  0x94  offset of the first image
///     0x80  Bayer format                                0x98, 0x9C  offset and size of the GPS summary
///     0x84  size of the configuration
///
/// A packet is either everything before the first image (the head and the camera's configuration), or one image
/// (ladybug_image.hpp), or the GPS summary, each with its bytes as they are in the file. Zeros between images are
/// padding and are left out. Images are found by their own size, and behind damage by the next beginning of an image;
/// the index is not needed. After NAME-000000.pgr follows NAME-000001.pgr, if it exists, and so on.
///
/// The file has no arrival times, so `received` says nothing about clocks: it starts at 0 and grows by 1 ms.
/// Fault packets: Malformed, with the number of bytes between images that are none; Lost, if a file has fewer images
/// than its head says.
/// Errors: open(): Io; Malformed if the file is no stream of a Ladybug. next(): EndOfData; Truncated once, if the last
/// image is cut off; Io.
/// Thread safety: none; one thread calls all functions.
class PgrSource final : public PacketSource {
 public:
  struct Config {
    std::string file;  ///< the first file
    void visit(Keys& keys);
  };
  explicit PgrSource(Config config) : config_(std::move(config)) {}

  Status open() override;
  Result<Packet> next(std::stop_token stop) override;
  void close() override { file_.reset(); }

 private:
  Status open_file(const std::filesystem::path& path);
  Result<Packet> packet(std::uint64_t offset, std::size_t size);
  Status skip_to_image();
  void end_file();

  const Config config_;
  std::optional<InputFile> file_;
  std::deque<Packet> pending_;
  std::optional<Error> ended_;
  std::uint64_t at_ = 0;          // next byte
  std::uint64_t images_end_ = 0;  // where images end: the GPS summary or the end of the file
  std::uint64_t summary_size_ = 0;
  std::uint64_t expected_images_ = 0, images_ = 0;
  HostTime received_{};
};

/// Returns the file that follows `path` in a recording that was split: "drive-000000.pgr", "drive-000001.pgr". Empty if
/// its name has no such number.
std::filesystem::path next_pgr_file(const std::filesystem::path& path);

}  // namespace hueline::drivers
