#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/input_file.hpp"
#include "core/result.hpp"
#include "core/time.hpp"

namespace hueline::drivers {

/// One link-layer frame of a capture file.
struct CaptureFrame {
  /// Time since 1970-01-01 UTC, as the capturing program stamped the frame; 0 if the file has no time.
  nanoseconds time{0};
  std::uint32_t link_type = 0;  ///< LINKTYPE_ number: 1 is Ethernet, 101 raw IP, 113 and 276 Linux cooked
  std::uint32_t length = 0;     ///< bytes on the wire; more than bytes.size() if the capture kept only the beginning
  std::uint64_t offset = 0;     ///< position of the frame's record in the file, bytes
  bool is_big_endian = false;   ///< byte order of the computer that wrote the file
  /// The name of the interface, or its number if it has no name; empty in classic pcap. Valid as `bytes`.
  std::string_view interface {};
  std::span<const std::byte> bytes;  ///< valid until the next call of CaptureFile::next()
};

/// Returns whether a file that begins with `first_bytes` is a capture file.
bool is_capture(std::string_view first_bytes);

/// Reads capture files frame by frame: classic pcap (either byte order, microseconds or nanoseconds) and pcapng
/// (sections, interfaces, enhanced, simple and old packet blocks; other blocks are skipped). All whole frames are
/// returned before an error.
/// Thread safety: none; one thread calls all functions.
/// Sources: draft-ietf-opsawg-pcap, draft-ietf-opsawg-pcapng.
class CaptureFile {
 public:
  /// Opens a file and reads its header. Errors: those of InputFile; Unsupported (neither format), Truncated (the header
  /// is not whole).
  static Result<CaptureFile> open(const std::string& path);
  /// Reads from any stream. Messages call it `name`.
  static Result<CaptureFile> from_stream(std::FILE* stream, std::string name);

  /// Returns the next frame. Errors: EndOfData after the last frame; Truncated or Malformed, with the offset in the
  /// file. After an error every call returns the same error.
  Result<CaptureFrame> next();

 private:
  struct Interface {
    std::uint32_t link_type = 0;
    std::uint64_t ticks_per_second = 1'000'000;
    std::int64_t offset_s = 0;
    std::uint32_t snap_length = 0;
    std::string name;
  };
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  enum class Fill { Whole, AtEnd, Cut };

  CaptureFile(std::FILE* stream, std::string name) : file_(stream), name_(std::move(name)) {}
  Status read_header();
  Result<CaptureFrame> next_classic();
  Result<CaptureFrame> next_block();
  std::optional<Error> begin_section();
  bool add_interface(std::span<const std::byte> body);
  std::optional<CaptureFrame> packet_block(std::uint32_t type, std::span<const std::byte> body);
  Fill fill(std::size_t size);
  std::uint32_t u32(const std::byte* p) const;
  std::uint16_t u16(const std::byte* p) const;
  Error error(ErrorCode code, const std::string& what) const;

  std::optional<InputFile> input_;  // protects the file from being overwritten by this program while it is read
  std::unique_ptr<std::FILE, Close> file_;
  std::string name_;
  bool is_blocks_ = false;   // the file is pcapng
  bool is_swapped_ = false;  // the file is big-endian
  std::uint64_t classic_ticks_per_second_ = 0;
  std::uint32_t classic_link_type_ = 0;
  std::vector<Interface> interfaces_;
  std::uint64_t offset_ = 0, record_ = 0;  // read position; start of the current record
  std::vector<std::byte> buffer_;
  std::optional<Error> ended_;
  std::optional<Error> read_error_;  // of the system, or of the network
};

}  // namespace hueline::drivers
