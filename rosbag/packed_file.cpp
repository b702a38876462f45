#include "rosbag/packed_file.hpp"

#include <zstd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <system_error>
#include <vector>

#include "core/input_file.hpp"
#include "core/input_folder.hpp"
#include "core/output_file.hpp"
#include "storage/file_writer.hpp"

namespace hueline::rosbag {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 2> kPackedEndings{".zstd", ".zst"};

std::string unpacked_name(const fs::path& packed) { return packed.stem().string(); }

Status unpack(const fs::path& from, const fs::path& to) {
  auto file = InputFile::open(from);
  if (!file.ok()) return file.error();
  auto writer = storage::FileWriter::create(to, IfExists::Replace);
  if (!writer.ok()) return writer.error();
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(), ZSTD_freeDStream);
  constexpr std::uint64_t kAlways = std::uint64_t{8} << 30U, kTimes = 64;
  const std::uint64_t most = std::max(kAlways, kTimes * file->size());
  std::vector<std::byte> packed(ZSTD_DStreamInSize()), plain(ZSTD_DStreamOutSize());
  std::size_t wanted = 1;  // bytes of input; 0: a frame is whole
  for (std::uint64_t at = 0; at < file->size();) {
    const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(packed.size(), file->size() - at));
    if (Status done = file->read(at, std::span(packed).first(size)); !done.ok()) return done.error();
    at += size;
    ZSTD_inBuffer in{packed.data(), size, 0};
    // A full output means that the stream may hold more of it.
    for (bool is_full = false; in.pos < in.size || is_full;) {
      ZSTD_outBuffer out{plain.data(), plain.size(), 0};
      wanted = ZSTD_decompressStream(stream.get(), &out, &in);
      if (ZSTD_isError(wanted))
        return Error{ErrorCode::Malformed, from.string() + " is damaged: " + ZSTD_getErrorName(wanted)};
      if (Status done = writer->write(std::span(plain).first(out.pos)); !done.ok()) return done.error();
      if (writer->size() > most)
        return Error{ErrorCode::Malformed, from.string() + " has more than 64 times its size unpacked"};
      is_full = out.pos == out.size && wanted != 0;
    }
  }
  if (wanted != 0) return Error{ErrorCode::Truncated, from.string() + " is cut: its compressed data do not end"};
  return writer->close();
}

}  // namespace

bool is_packed_name(std::string_view name) {
  const auto ending = std::ranges::find_if(kPackedEndings, [&](std::string_view one) { return name.ends_with(one); });
  if (ending == kPackedEndings.end()) return false;
  name.remove_suffix(ending->size());
  return name.ends_with(".db3") || name.ends_with(".mcap") || name.ends_with(".bag");
}

Result<fs::path> unpacked_recording(const fs::path& recording, const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(recording, error)) {
    if (!is_packed_name(recording.filename().string())) return recording;
    const fs::path plain = folder / unpacked_name(recording);
    fs::create_directories(folder, error);
    if (error) return output_error("cannot make " + folder.string(), error.value());
    if (Status done = unpack(recording, plain); !done.ok()) return done.error();
    return plain;
  }
  const auto names = list_folder(recording);
  if (!names.ok()) return names.error();
  if (std::ranges::none_of(*names, is_packed_name)) return recording;
  fs::create_directories(folder, error);
  if (error) return output_error("cannot make " + folder.string(), error.value());
  for (const std::string& name : *names) {
    const bool is_unpacked_too = is_packed_name(name) && holds(recording, unpacked_name(name));
    if (is_unpacked_too || fs::is_directory(recording / name, error)) continue;
    if (is_packed_name(name)) {
      if (Status done = unpack(recording / name, folder / unpacked_name(name)); !done.ok()) return done.error();
      continue;
    }
    fs::create_symlink(fs::absolute(recording / name, error), folder / name, error);
    if (error) return output_error("cannot make " + (folder / name).string(), error.value());
  }
  return folder;
}

}  // namespace hueline::rosbag
